use std::io;

use glam::Vec3;
use plotters::prelude::*;

use super::{
    palette::VERMILION,
    picture::{Area, Backend, ChartFormat, Drawn, Picture, Plan, Side, encode, point},
    printable::one_line,
};
use osp::math::Aabb;
use osp_session::rig::{Rig, Screen};

const SIZE: (u32, u32) = (1280, 640);
const MARGIN: f64 = 60.0;

/// A drawing of a rig's room from above and from the front: the screens, the head, and its frustum through each screen.
#[derive(Clone, Copy, Debug)]
pub struct RigPlan<'a>(pub &'a Rig);

impl RigPlan<'_> {
    /// The bytes of the picture's file.
    ///
    /// # Errors
    /// The picture cannot be drawn.
    pub fn encode(&self, format: ChartFormat) -> io::Result<Vec<u8>> {
        encode(self, format, SIZE)
    }

    fn draw_side<B: Backend>(&self, title: &str, side: Side, area: &Area<B>) -> Drawn {
        let rig = self.0;
        let area = area.titled(title, ("sans-serif", 22))?;
        let corners = rig.screens.iter().flat_map(corners_of).chain([rig.head]);
        let bounds = corners.fold(Aabb::EMPTY, |all, p| all.union(&Aabb { min: p, max: p }));
        let plan = Plan::new(side, &bounds, area.dim_in_pixel(), MARGIN);
        let pixel = |p: Vec3| point(&plan.pixel(p));
        let head = pixel(rig.head);
        for screen in &rig.screens {
            let corners = corners_of(screen);
            for corner in corners {
                area.draw(&PathElement::new([head, pixel(corner)], BLACK.mix(0.15)))?;
            }
            let outline: Vec<(i32, i32)> = corners.iter().chain([&corners[0]]).map(|&p| pixel(p)).collect();
            area.draw(&Polygon::new(outline.clone(), BLUE.mix(0.08)))?;
            area.draw(&PathElement::new(outline, BLUE.stroke_width(3)))?;
            let middle = pixel(corners.iter().sum::<Vec3>() * 0.25);
            // The name is beside the screen, which is a line when seen edge-on.
            let middle = (middle.0 + 8, middle.1 + 6);
            area.draw(&Text::new(one_line(&screen.name), middle, ("sans-serif", 18).into_font()))?;
        }
        area.draw(&Circle::new(head, 6, VERMILION.filled()))?;
        area.draw(&Text::new("head", (head.0 + 9, head.1 - 6), ("sans-serif", 18).into_font()))?;
        // A scale bar.
        let lengths = [(1.0, "1 m"), (0.1, "10 cm"), (0.01, "1 cm")];
        let (length_m, name) = lengths
            .into_iter()
            .find(|(m, _)| m * plan.scale <= plan.size.x - MARGIN)
            .unwrap_or((0.001, "1 mm"));
        let (y, x) = ((plan.size.y - 18.0) as i32, 20);
        let end = x + (length_m * plan.scale) as i32;
        area.draw(&PathElement::new([(x, y), (end, y)], BLACK.stroke_width(2)))?;
        area.draw(&Text::new(name, (x, y - 20), ("sans-serif", 16).into_font()))?;
        Ok(())
    }
}

impl Picture for RigPlan<'_> {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Drawn {
        area.fill(&WHITE)?;
        let name = one_line(&self.0.name);
        let halves = area.split_evenly((1, 2));
        self.draw_side(&format!("{name} from above"), Side::Top, &halves[0])?;
        self.draw_side(&format!("{name} from the front"), Side::Front, &halves[1])?;
        area.present()?;
        Ok(())
    }
}

/// The screen's corners in order around it.
fn corners_of(screen: &Screen) -> [Vec3; 4] {
    let opposite = screen.lower_right + screen.upper_left - screen.lower_left;
    [screen.lower_left, screen.lower_right, opposite, screen.upper_left]
}

use std::{collections::HashMap, sync::LazyLock};

use super::Brush;

static BRUSHES: LazyLock<Vec<Brush>> = LazyLock::new(|| {
    let mut brushes: Vec<Brush> = ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
        .from_str(include_str!("brushes.ron"))
        .expect("the crate's own table, which a test reads");
    for (number, brush) in (0..).zip(&mut brushes) {
        brush.number = number;
    }
    brushes
});

static PLACES: LazyLock<HashMap<&'static str, u16>> = LazyLock::new(|| {
    let mut places = HashMap::new();
    for (i, brush) in BRUSHES.iter().enumerate() {
        let names = [&brush.name, &brush.guid].into_iter().chain(&brush.also);
        places.extend(names.map(|name| (name.as_str(), i as u16)));
    }
    places
});

/// Every brush; the index of a brush is its [`number`](Brush::number).
pub fn all() -> &'static [Brush] {
    &BRUSHES
}

pub fn find(name_or_guid: &str) -> Option<&'static Brush> {
    BRUSHES.get(usize::from(*PLACES.get(name_or_guid)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_brush_is_found_by_its_name_and_its_guids() {
        assert!(all().len() > 100);
        for (i, brush) in all().iter().enumerate() {
            for name in [&brush.name, &brush.guid].into_iter().chain(&brush.also) {
                assert_eq!(find(name).map(Brush::number), Some(i as u16), "{name}");
            }
        }
        assert_eq!(find("no such brush"), None);
    }

    #[test]
    fn sizes_and_opacities_follow_the_pressure() {
        let ink = find("Ink").expect("a brush of the table");
        assert_eq!(ink.size(1.0), 1.0);
        assert_eq!(ink.size(0.0), ink.pressure_size_min);
        assert!(
            all().iter().all(|brush| (0.0..=1.0).contains(&brush.opacity(0.3)) && brush.size(-1.0) >= 0.0)
        );
    }
}

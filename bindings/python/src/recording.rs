use std::{collections::HashMap, path::PathBuf};

use numpy::{IntoPyArray, PyArray1};
use osp::{
    glam::{Quat, Vec3},
    math::Aabb,
    polygon::Geometry,
};
use osp_session::{
    recording::{Event, Header, Layer, Limits, OpenOptions, Pace, Paint, StrokeId, Tool, open},
    replay::{ArtistSide, Player, whole_view},
    scene::Scene,
};
use pyo3::{
    IntoPyObjectExt,
    exceptions::PyValueError,
    prelude::*,
    types::{PyDict, PyList},
};

use crate::{arrays, errors, signals::Signals, view::View};

/// Number of samples that are applied to the model at once. The result does not depend on this number.
const AT_ONCE: u32 = 1024;

/// Returns the options for reading a file, from the arguments that all reading functions share.
pub(crate) fn options(lenient: bool, max_polygons: Option<u64>) -> PyResult<OpenOptions> {
    let polygons = max_polygons.unwrap_or(Limits::DEFAULT.polygons);
    if !(1..=u64::from(u32::MAX)).contains(&polygons) {
        let message = format!("max_polygons: expected 1 to {}; found {polygons}", u32::MAX);
        return Err(PyValueError::new_err(message));
    }
    Ok(OpenOptions { lenient, limits: Limits { polygons, ..Limits::DEFAULT }, ..OpenOptions::STRICT })
}

/// A row of the table of strokes.
struct StrokeRow {
    id: u32,
    tool: &'static str,
    brush: String,
    width_m: f32,
    color: [f32; 4],
    begin_secs: f64,
    end_secs: f64,
    points: u32,
}

/// Poses of control points or of heads: times, positions, rotations.
#[derive(Default)]
struct Poses {
    times_secs: Vec<f64>,
    positions: Vec<[f32; 3]>,
    rotations: Vec<[f32; 4]>,
}

impl Poses {
    fn push(&mut self, time_secs: f64, position: Vec3, rotation: Quat) {
        self.times_secs.push(time_secs);
        self.positions.push(position.to_array());
        self.rotations.push(rotation.to_array());
    }

    fn fill(&self, py: Python<'_>, table: &Bound<'_, PyDict>) -> PyResult<()> {
        table.set_item("time_secs", PyArray1::from_slice(py, &self.times_secs))?;
        table.set_item("position", arrays::table(py, &self.positions)?)?;
        table.set_item("rotation", arrays::table(py, &self.rotations)?)
    }
}

/// A recorded session that was read to its end. `osp.open` creates it.
#[pyclass(module = "osp._native", frozen)]
pub(crate) struct Recording {
    path: PathBuf,
    format: &'static str,
    header: Header,
    /// The layers in their state at the end.
    layers: Vec<Layer>,
    warnings: Vec<String>,
    skipped: u64,
    events: u64,
    strokes: Vec<StrokeRow>,
    point_strokes: Vec<u32>,
    points: Poses,
    pressures: Vec<f32>,
    heads: Poses,
    scene: Scene,
    artist: ArtistSide,
    bounds: Aabb,
}

impl std::fmt::Debug for Recording {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recording").field("path", &self.path).finish_non_exhaustive()
    }
}

/// Reads a session to its end.
#[pyfunction]
#[pyo3(signature = (path, lenient=false, max_polygons=None))]
pub(crate) fn open_recording(
    py: Python<'_>,
    path: PathBuf,
    lenient: bool,
    max_polygons: Option<u64>,
) -> PyResult<Recording> {
    let options = options(lenient, max_polygons)?;
    py.detach(|| Recording::read(path, &options))
}

#[pymethods]
impl Recording {
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    #[getter]
    fn format(&self) -> &'static str {
        self.format
    }

    #[getter]
    fn name(&self) -> &str {
        &self.header.name
    }

    #[getter]
    fn source(&self) -> &str {
        &self.header.source
    }

    #[getter]
    fn layers(&self) -> Vec<&str> {
        self.layers.iter().map(|layer| layer.name.as_str()).collect()
    }

    #[getter]
    fn left_out(&self) -> Vec<String> {
        self.header.left_out.clone()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    #[getter]
    fn skipped(&self) -> u64 {
        self.skipped
    }

    #[getter]
    fn events(&self) -> u64 {
        self.events
    }

    /// Smallest and largest corner of the model; None if the model is empty.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        if self.bounds.is_empty() {
            return Ok(None);
        }
        let rows = [self.bounds.min.to_array(), self.bounds.max.to_array()];
        Ok(Some(arrays::table(py, &rows)?.into_any()))
    }

    fn whole_view(&self, aspect: f64) -> PyResult<View> {
        if !(1.0e-3..=1.0e3).contains(&aspect) {
            let message = format!("aspect: expected a number from 0.001 to 1000; found {aspect}");
            return Err(PyValueError::new_err(message));
        }
        Ok(View { view: whole_view(&self.bounds, self.artist.direction_to_artist(None), aspect as f32) })
    }

    fn strokes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        fn column<T>(rows: &[StrokeRow], of: impl Fn(&StrokeRow) -> T) -> Vec<T> {
            rows.iter().map(of).collect()
        }
        let rows = &self.strokes;
        let known = |row: &StrokeRow| self.scene.stroke(StrokeId(row.id));
        table.set_item("stroke", column(rows, |row| row.id).into_pyarray(py))?;
        table.set_item("tool", texts(py, rows.iter().map(|row| row.tool))?)?;
        table.set_item("brush", texts(py, rows.iter().map(|row| row.brush.as_str()))?)?;
        table.set_item("color", arrays::table(py, &column(rows, |row| row.color))?)?;
        table.set_item("width_m", column(rows, |row| row.width_m).into_pyarray(py))?;
        table.set_item("begin_secs", column(rows, |row| row.begin_secs).into_pyarray(py))?;
        table.set_item("end_secs", column(rows, |row| row.end_secs).into_pyarray(py))?;
        table.set_item("points", column(rows, |row| row.points).into_pyarray(py))?;
        let layer = column(rows, |row| known(row).map_or(0, osp_session::scene::Stroke::layer));
        table.set_item("layer", layer.into_pyarray(py))?;
        let is_visible = column(rows, |row| known(row).is_some_and(osp_session::scene::Stroke::is_visible));
        table.set_item("visible", is_visible.into_pyarray(py))?;
        Ok(table)
    }

    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        table.set_item("stroke", PyArray1::from_slice(py, &self.point_strokes))?;
        self.points.fill(py, &table)?;
        table.set_item("pressure", PyArray1::from_slice(py, &self.pressures))?;
        Ok(table)
    }

    fn heads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        self.heads.fill(py, &table)?;
        Ok(table)
    }

    fn polygons<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (mut ids, mut strokes, mut counts) = (Vec::new(), Vec::new(), Vec::<u8>::new());
        let (mut corners, mut colors, mut opaque) = (Vec::new(), Vec::new(), Vec::new());
        let (mut triangles, mut polygon_of) = (Vec::new(), Vec::new());
        py.detach(|| {
            for id in self.scene.visible_ids().filter(|&id| self.scene.has_area(id)) {
                let polygon = self.scene.polygon(id);
                let vertices = polygon.vertices();
                let row = ids.len() as u32;
                let last = vertices[vertices.len() - 1];
                corners.extend((0..4).map(|i| vertices.get(i).copied().unwrap_or(last)));
                for pair in vertices[1..].windows(2) {
                    triangles.extend([vertices[0], pair[0], pair[1]]);
                    polygon_of.push(row);
                }
                let stroke = self.scene.stroke_of(id);
                let (r, g, b, a) = stroke.color();
                ids.push(id.0);
                strokes.push(stroke.id().map_or(-1, |id| i64::from(id.0)));
                counts.push(vertices.len() as u8);
                colors.push([r, g, b, a]);
                // A polygon of a brush with holes hides things only partly, so it does not count as opaque.
                opaque.push(self.scene.occluder(id) == Some(polygon));
            }
        });
        let table = PyDict::new(py);
        table.set_item("polygon", ids.into_pyarray(py))?;
        table.set_item("stroke", strokes.into_pyarray(py))?;
        table.set_item("corners", arrays::cube(py, &corners, 4)?)?;
        table.set_item("corner_count", counts.into_pyarray(py))?;
        table.set_item("color", arrays::table(py, &colors)?)?;
        table.set_item("opaque", opaque.into_pyarray(py))?;
        let both = PyDict::new(py);
        both.set_item("polygons", table)?;
        both.set_item("triangles", arrays::cube(py, &triangles, 3)?)?;
        both.set_item("polygon_of_triangle", polygon_of.into_pyarray(py))?;
        Ok(both)
    }
}

/// Returns the texts as a numpy array.
fn texts<'py, 'a>(py: Python<'py>, texts: impl Iterator<Item = &'a str>) -> PyResult<Bound<'py, PyAny>> {
    let list = PyList::new(py, texts.collect::<Vec<_>>())?;
    // Without the type, numpy would convert an empty list to numbers.
    py.import("numpy")?.call_method1("array", (list, "str".into_py_any(py)?))
}

impl Recording {
    fn read(path: PathBuf, options: &OpenOptions) -> PyResult<Self> {
        let failed = |error| errors::of_recording(&error);
        let session = open(&path, options).map_err(failed)?;
        let (header, format) = (session.header.clone(), session.format);
        let mut recording = Self {
            layers: header.layers.clone(),
            path,
            format,
            header,
            warnings: Vec::new(),
            skipped: 0,
            events: 0,
            strokes: Vec::new(),
            point_strokes: Vec::new(),
            points: Poses::default(),
            pressures: Vec::new(),
            heads: Poses::default(),
            scene: Scene::new(),
            artist: ArtistSide::default(),
            bounds: Aabb::EMPTY,
        };
        let mut session = Noting { session, notes: None };
        let mut player = Player::new(&mut session, Pace::Samples(AT_ONCE));
        let mut signals = Signals::new();
        let mut rows = HashMap::new();
        while player.step().map_err(failed)? {
            player.events().iter().for_each(|event| recording.note(event, &mut rows));
            signals.check()?;
        }
        recording.scene = player.into_state().scene;
        let notes = session.notes.unwrap_or_default();
        (recording.warnings, recording.skipped) = (notes.warnings, notes.skipped);
        let boxes = recording.scene.visible_ids().map(|id| recording.scene.bounds(id));
        recording.bounds = boxes.fold(Aabb::EMPTY, |all, bounds| all.union(&bounds));
        Ok(recording)
    }

    fn note(&mut self, event: &Event, rows: &mut HashMap<u32, usize>) {
        self.events += 1;
        self.artist.note(event);
        match event {
            Event::Head { t, p, q, .. } => self.heads.push(*t, *p, *q),
            Event::Begin { t, stroke, tool, width, color, paint, .. } => {
                let tool = match tool {
                    Tool::Ribbon => "ribbon",
                    Tool::Wall => "wall",
                    Tool::Tube => "tube",
                };
                self.begin(rows, stroke.0, tool, paint.as_deref(), *width, *color, *t);
            }
            Event::Point { t, stroke, p, q, pressure } => {
                self.point_strokes.push(stroke.0);
                self.points.push(*t, *p, *q);
                self.pressures.push(*pressure);
                if let Some(&row) = rows.get(&stroke.0) {
                    self.strokes[row].points += 1;
                }
            }
            Event::End { t, stroke } => {
                if let Some(&row) = rows.get(&stroke.0) {
                    self.strokes[row].end_secs = *t;
                }
            }
            Event::Polygon { t, stroke: Some(stroke), color, .. } => {
                self.begin(rows, stroke.0, "polygon", None, 0.0, *color, *t);
            }
            Event::Layer { layer, name, .. } => {
                // The event creates all missing layers up to its number.
                let at = *layer as usize;
                if at >= self.layers.len() {
                    self.layers.resize(at + 1, Layer { name: String::new(), hidden: false });
                }
                if let Some(name) = name {
                    self.layers[at].name.clone_from(name);
                }
            }
            _ => {}
        }
    }

    /// Adds a stroke, unless its number is in use.
    #[expect(clippy::too_many_arguments, reason = "the values of the beginning of a stroke")]
    fn begin(
        &mut self,
        rows: &mut HashMap<u32, usize>,
        id: u32,
        tool: &'static str,
        paint: Option<&Paint>,
        width_m: f32,
        (r, g, b, a): (f32, f32, f32, f32),
        begin_secs: f64,
    ) {
        let row = self.strokes.len();
        if *rows.entry(id).or_insert(row) != row {
            return;
        }
        let named = paint.map_or("", |paint| paint.brush.as_str());
        // A GUID is replaced by the name of the brush, if the brush is known.
        let brush = osp_session::brush::find(named).map_or(named, |brush| &brush.name).to_owned();
        let (color, end_secs) = ([r, g, b, a], f64::NAN);
        self.strokes.push(StrokeRow { id, tool, brush, width_m, color, begin_secs, end_secs, points: 0 });
    }
}

/// A session that keeps the reader's notes after its end.
struct Noting {
    session: osp_session::recording::Session,
    notes: Option<osp_session::recording::Notes>,
}

impl Iterator for Noting {
    type Item = Result<Event, osp_session::recording::RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = self.session.next();
        if next.is_none() {
            self.notes = Some(self.session.events.notes());
        }
        next
    }
}

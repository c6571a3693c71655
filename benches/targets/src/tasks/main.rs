//! Five tasks of an engine, solved with osp and with three other crates: lines of code, and times. Each solution is the
//! shortest that its crate allows. `cargo run --release --manifest-path benches/targets/Cargo.toml --bin tasks`.
//!
//! The engine's keys have 64 bits. All solutions must return the same results.

mod planes;
mod times;
mod with_obvhs;
mod with_osp;
mod with_parry;
mod with_rstar;

/// The minimum and the maximum corner, metres.
type Bounds = [[f32; 3]; 2];

/// The tasks of an engine in a frame.
trait Tasks {
    /// Inserts objects.
    fn come(&mut self, objects: &[(u64, Bounds)]);
    /// Moves an object.
    fn shift(&mut self, key: u64, bounds: Bounds);
    /// Removes an object.
    fn go(&mut self, key: u64);
    /// Returns the objects whose boxes are in a camera's frustum. The matrix is column-major and maps world to clip
    /// space, with depths from 0 to 1.
    fn draw(&mut self, clip_from_world: &[f32; 16]) -> Vec<u64>;
    /// Returns the object whose box a ray enters first, and the ray's parameter there.
    fn pick(&self, origin: [f32; 3], direction: [f32; 3]) -> Option<(u64, f32)>;
}

/// The functions of [`Tasks`] with the names of their rows in the table.
const TASKS: [(&str, &str); 5] = [
    ("come", "objects come"),
    ("shift", "one moves"),
    ("go", "one goes"),
    ("draw", "what a camera sees"),
    ("pick", "the first on a ray"),
];

/// A camera of 90 degrees along -z, with near plane 0.1 and far plane 100.
const CLIP: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.001001, -1.0, 0.0, 0.0, -0.1001001, 0.0];

fn key(i: u64) -> u64 {
    i.wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

fn bounds(i: u64, z: f32) -> Bounds {
    // No box is so close to a plane of the frustum that rounding could change the result.
    let corner =
        [(i % 20) as f32 * 0.97 - 9.83, (i / 20 % 20) as f32 * 1.01 - 10.31, z - (i / 400) as f32 * 0.93];
    [corner, corner.map(|v| v + 0.5)]
}

/// Returns the results of twenty frames.
fn play(world: &mut dyn Tasks) -> Vec<(Vec<u64>, Option<u64>)> {
    let objects: Vec<_> = (0..1000).map(|i| (key(i), bounds(i, -4.0))).collect();
    world.come(&objects);
    let mut answers = Vec::new();
    for frame in 0..20 {
        world.shift(key(frame), bounds(frame + 77, 3.25));
        world.shift(key(500 + frame), bounds(frame + 333, -9.75));
        world.go(key(990 - frame));
        world.come(&[(key(2000 + frame), bounds(3 * frame, -2.25))]);
        let mut seen = world.draw(&CLIP);
        seen.sort_unstable();
        let picked = world.pick([0.1, 0.05, 3.0], [0.05 * frame as f32 - 0.45, 0.01, -1.0]);
        answers.push((seen, picked.map(|(key, _)| key)));
    }
    answers
}

/// Counts the lines of a function, without comments and blank lines.
fn lines_of(source: &str, function: &str) -> usize {
    let begin = format!("    fn {function}(");
    let lines = source.lines().skip_while(|line| !line.starts_with(&begin));
    let body: Vec<_> = lines.take_while(|line| *line != "    }").collect();
    body.iter().filter(|line| is_code(line)).count() + 1
}

fn is_code(line: &str) -> bool {
    !line.trim().is_empty() && !line.trim_start().starts_with("//")
}

fn main() {
    let planes = include_str!("planes.rs").lines().filter(|line| is_code(line)).count();
    let solutions: [(&str, &str, Box<dyn Tasks>); 4] = [
        ("osp", include_str!("with_osp.rs"), Box::<with_osp::World>::default()),
        ("parry3d", include_str!("with_parry.rs"), Box::<with_parry::World>::default()),
        ("obvhs", include_str!("with_obvhs.rs"), Box::<with_obvhs::World>::default()),
        ("rstar", include_str!("with_rstar.rs"), Box::<with_rstar::World>::default()),
    ];
    let mut rows: Vec<(&str, Vec<usize>)> = vec![("kept and imported", Vec::new())];
    rows.extend(TASKS.iter().map(|(_, row)| (*row, Vec::new())));
    rows.push(("all", Vec::new()));
    let mut expected = None;
    let mut names = Vec::new();
    for (name, source, mut world) in solutions {
        let answers = play(&mut *world);
        assert!(answers.iter().any(|(seen, picked)| seen.len() > 100 && picked.is_some()));
        let pairs = expected.get_or_insert_with(|| answers.clone()).iter().zip(&answers);
        for (frame, (expected, found)) in pairs.enumerate() {
            let counts = (expected.0.len(), found.0.len(), expected.1, found.1);
            assert!(expected == found, "{name}, frame {frame}: {counts:?}");
        }
        let mut of_tasks = TASKS.map(|(function, _)| lines_of(source, function));
        let all = source.lines().filter(|line| is_code(line)).count();
        let kept = all - of_tasks.iter().sum::<usize>();
        // A crate without cameras also needs the code of planes.rs.
        let own = if source.contains("planes::") { planes } else { 0 };
        of_tasks[3] += own;
        let column = [kept].into_iter().chain(of_tasks).chain([all + own]);
        rows.iter_mut().zip(column).for_each(|((_, row), lines)| row.push(lines));
        names.push(name);
    }
    println!("| lines | {} |\n| --- |{}", names.join(" | "), " ---: |".repeat(names.len()));
    for (row, lines) in rows {
        let lines: Vec<_> = lines.iter().map(ToString::to_string).collect();
        println!("| {row} | {} |", lines.join(" | "));
    }
    times::print(&names);
}

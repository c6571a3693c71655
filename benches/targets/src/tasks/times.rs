//! The times of the tasks. Every frame measures all crates, in rotating order, on one thread.

use std::{hint::black_box, time::Instant};

use crate::{CLIP, TASKS, Tasks, bounds, key, with_obvhs, with_osp, with_parry, with_rstar};

const OBJECTS: u64 = 10_000;
/// Number of objects that each frame inserts, and also moves, and also removes.
const CHANGES: u64 = 16;
const FRAMES: u64 = 400;

/// Prints the median time of each task of a frame. osp applies the changes of a frame only when it culls. The last row
/// has whole frames, so it compares all crates fairly.
pub(crate) fn print(names: &[&str]) {
    let mut worlds: [Box<dyn Tasks>; 4] = [
        Box::<with_osp::World>::default(),
        Box::<with_parry::World>::default(),
        Box::<with_obvhs::World>::default(),
        Box::<with_rstar::World>::default(),
    ];
    let objects: Vec<_> = (0..OBJECTS).map(|i| (key(i), bounds(i, -4.0))).collect();
    for world in &mut worlds {
        world.come(&objects);
        black_box(world.draw(&CLIP));
    }
    let mut times = vec![[const { Vec::new() }; TASKS.len() + 1]; worlds.len()];
    for frame in 0..FRAMES {
        for turn in 0..worlds.len() {
            let at = (turn + frame as usize) % worlds.len();
            for (sum, ns) in times[at].iter_mut().zip(frame_ns(&mut *worlds[at], frame)) {
                sum.push(ns);
            }
        }
    }
    println!(
        "\n| µs, {OBJECTS} objects, {CHANGES} come, move and go in a frame | {} |\n| --- |{}",
        names.join(" | "),
        " ---: |".repeat(names.len())
    );
    for row in 0..=TASKS.len() {
        let median = |of: &mut [Vec<u64>; TASKS.len() + 1]| {
            of[row].sort_unstable();
            format!("{:.2}", of[row][of[row].len() / 2] as f64 / 1000.0)
        };
        let cells: Vec<_> = times.iter_mut().map(median).collect();
        println!("| {} | {} |", TASKS.get(row).map_or("a frame", |(_, task)| task), cells.join(" | "));
    }
}

/// Returns the time of each task in a frame, and their sum, nanoseconds.
fn frame_ns(world: &mut dyn Tasks, frame: u64) -> [u64; TASKS.len() + 1] {
    // New objects have the highest numbers; the objects with the lowest numbers are removed.
    let first = frame * CHANGES;
    let new: Vec<_> =
        (0..CHANGES).map(|i| (key(OBJECTS + first + i), bounds(7 * (first + i) % OBJECTS, -4.0))).collect();
    let mut ns = [0; TASKS.len() + 1];
    let mut timed = |task: usize, work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        ns[task] = start.elapsed().as_nanos() as u64;
        ns[TASKS.len()] += ns[task];
    };
    timed(0, &mut || world.come(&new));
    timed(1, &mut || {
        for i in 0..CHANGES {
            let moved = first + CHANGES + 41 * i;
            world.shift(key(moved), bounds(moved * 13 % OBJECTS, -4.5));
        }
    });
    timed(2, &mut || (0..CHANGES).for_each(|i| world.go(key(first + i))));
    timed(3, &mut || drop(black_box(world.draw(&CLIP))));
    timed(4, &mut || {
        black_box(world.pick([0.1, 0.05, 3.0], [0.01, 0.02, -1.0]));
    });
    ns
}

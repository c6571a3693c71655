//! A culler that takes over the objects of another one.

use osp::{Camera, Culler, Dense, Depth, Key, Occluder, Refusal};

use osp_testkit::boxes::Rng;

/// A square that faces the eye at the origin, at a distance along -z.
fn quad(distance_m: f32, half_m: f32) -> Occluder {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    Occluder::quad(corners.map(|[x, y]| [x * half_m, y * half_m, -distance_m])).expect("a quad")
}

fn cube(center: [f32; 3], half_m: f32) -> [[f32; 3]; 2] {
    [center.map(|c| c - half_m), center.map(|c| c + half_m)]
}

fn ahead() -> Camera {
    let clip = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.1, 0.0_f32];
    Camera::from_matrix(clip, Depth::OneToZero).expect("a camera")
}

/// What a camera sees, and what it sees by occluders, ascending.
fn seen<K: Key + Ord>(culler: &mut Culler<K>) -> [Vec<K>; 2] {
    let frame = culler.cull(&[ahead(), ahead().hide_by_occluders()]);
    [0, 1].map(|camera| {
        let mut keys: Vec<K> = frame[camera].iter().collect();
        keys.sort_unstable();
        keys
    })
}

/// Calls that fill a culler: two parts of which the second replaces objects of the first.
fn fill<K: Key>(culler: &mut Culler<K>, part: u32, key: impl Fn(u32) -> K) {
    let mut rng = Rng(u64::from(part) + 5);
    for i in part * 400..part * 400 + 600 {
        let center = [rng.range(-9.0, 9.0), rng.range(-9.0, 9.0), rng.range(-20.0, 20.0)];
        culler.set(key(i), cube(center, 0.3));
        if i % 7 == 0 {
            culler.set_layers(key(i), 0);
        }
    }
    // A wall that is drawn, and one without a box; the second part has other ones.
    let distance_m = 3.0 + part as f32 * 4.0;
    culler.set(key(5000), cube([0.0, 0.0, -distance_m], 3.0));
    culler.set_occluder(key(5000), quad(distance_m, 1.0));
    culler.set_occluder(key(6000), quad(distance_m + 1.0, 1.5 + part as f32));
    culler.set(key(7000), [[0.0, f32::NAN, 0.0], [1.0_f32; 3]]);
}

fn check<K: Key + Ord + std::fmt::Debug + Send + 'static>(key: impl Fn(u32) -> K + Copy + Send + 'static)
where
    Culler<K>: Send,
{
    for (is_first_full, commits) in [(true, true), (true, false), (false, true)] {
        let mut expected = Culler::new();
        let mut culler = Culler::new();
        if is_first_full {
            fill(&mut expected, 0, key);
            // The second part's objects replace these, with their layers and occluders.
            for i in (400..1000).chain([5000, 6000]) {
                expected.remove(key(i));
            }
            fill(&mut culler, 0, key);
            culler.commit();
        }
        fill(&mut expected, 1, key);
        let other = std::thread::spawn(move || {
            let mut other = Culler::new();
            fill(&mut other, 1, key);
            if commits {
                other.commit();
            }
            other
        });
        culler.set(key(8000), [[f32::NAN; 3], [1.0; 3]]);
        culler.append(other.join().expect("a filled culler"));
        assert_eq!(culler.len(), expected.len());
        let [all, drawn] = seen(&mut expected);
        assert!(drawn.len() < all.len(), "walls hide something");
        assert_eq!(seen(&mut culler), [all, drawn], "{is_first_full} {commits}");
        for number in [7000, 8000] {
            let is_of = |(of, why)| of == key(number) && matches!(why, Refusal::Bounds(_));
            assert!(culler.refused().any(is_of), "{number}");
        }
        for i in [0, 399, 400, 599, 999, 5000, 6000, 7000] {
            assert_eq!(culler.bounds(key(i)), expected.bounds(key(i)), "{i}");
        }
        // Both go on as one.
        for culler in [&mut culler, &mut expected] {
            culler.remove(key(5000));
            culler.remove(key(6000));
            culler.set(key(450), cube([0.0, 0.0, -2.0], 0.1));
        }
        assert_eq!(seen(&mut culler), seen(&mut expected));
    }
}

#[test]
fn objects_occluders_and_layers_of_another_culler_are_taken_over() {
    check(Dense);
    check(|i| u64::from(i) << 20);
}

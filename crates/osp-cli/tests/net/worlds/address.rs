//! Worlds behind an address: `osp serve` is the server.

use std::sync::Arc;

use glam::Vec3;
use osp_net::world::{Flight, Missing, PackOrder, Place, World, WorldError};
use osp_session::recording::SynthKind;

use super::{Together, pack, session, walk};
use crate::serve::Server;
use osp_testkit::temp;

#[test]
fn a_world_behind_http_is_that_of_the_folder() {
    let folder = temp();
    let portrait = session(SynthKind::Portrait, 20_000, 1);
    let parts: [(&_, &[Vec3]); 1] = [(&portrait, &[Vec3::ZERO, Vec3::Z * 30.0])];
    pack(&folder.path().join("a world"), PackOrder::Space, &parts).expect("packed");
    let server = Server::of(folder.path());
    let address = format!("http://{}/a%20world", server.address);
    let world = Arc::new(World::open(Place::to_read(&address).expect("an address")).expect("a world"));
    let views: Vec<_> = Flight::new(&world.bounds(), 1, None, None).step_by(30).take(20).collect();
    let expected = Together::new(&parts).seen(&views);
    let mut walk = walk(&world, 6 << 20, 3);
    for (view, (visible, fingerprint)) in views.iter().zip(expected) {
        let frame = walk.frame(view, None, Missing::Wait).expect("whole blocks");
        assert_eq!((frame.visible, frame.fingerprint), (visible, fingerprint));
    }
    assert!(walk.counts().bytes_read > 0);
    let none = World::open(Place::to_read(&format!("http://{}/none", server.address)).expect("an address"));
    assert!(matches!(none, Err(WorldError::Place { .. })), "{none:?}");
    let refused = Place::to_write(&address).map(drop).expect_err("read only").to_string();
    assert!(refused.contains("s3://"), "{refused}");
    drop(server);
    let gone = World::open(Place::to_read(&address).expect("an address"));
    assert!(matches!(gone, Err(WorldError::Object { .. })), "{gone:?}");
}

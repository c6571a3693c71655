//! Trees of other crates in the form in which they are compared: a session that grows, loses and moves polygons.

use super::{Pair, subjects::Subject};
use osp::{index::IndexConfig, math::Aabb};
use osp_rivals::PeerKind;
use osp_testkit::boxes::{Place, drawn, root, shuffled, views};

#[test]
fn they_answer_what_brute_force_does() {
    let config = IndexConfig { root: root(), capacity: 100 };
    let frusta = [views(&root(), 8, Place::Inside, 1), views(&root(), 4, Place::Outside, 2)].concat();
    for boxes in [drawn(2000, 3), shuffled(drawn(2000, 3), 4)] {
        for &kind in PeerKind::ALL {
            let subject = Subject { name: kind.name(), make: Box::new(move |config| kind.create(config)) };
            let mut pair = Pair::new(&subject, &config, &frusta, kind.name().to_owned());
            pair.check("nothing yet");
            for (n, batch) in boxes.chunks(500).enumerate() {
                batch.iter().enumerate().for_each(|(i, b)| pair.insert(n * 500 + i, b));
                pair.check("growing");
            }
            (0..2000).step_by(3).for_each(|id| pair.remove(id));
            pair.check("a third gone");
            (0..2000).step_by(6).for_each(|id| pair.insert(id, &boxes[id]));
            pair.check("half of it back");
            let moved = |b: &Aabb| Aabb::new(b.min + b.extent(), b.max + b.extent());
            (0..2000).filter(|id| id % 3 == 1).for_each(|id| pair.update(id, &moved(&boxes[id])));
            pair.check("moved");
            (0..2000).filter(|id| id % 3 != 0 || id % 6 == 0).for_each(|id| pair.update(id, &boxes[id]));
            pair.check("all of it back at its place");
            (0..2000).step_by(12).for_each(|id| pair.remove(id));
            pair.update(1999, &moved(&boxes[1999]));
            pair.check("gone and moved in one batch");
            pair.clear();
            pair.check("cleared");
            boxes.iter().take(50).enumerate().for_each(|(id, b)| pair.insert(id, b));
            pair.check("again");
        }
    }
}

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

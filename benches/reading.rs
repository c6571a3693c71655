//! Measures reading and writing of a recording, in events per second. A general RON parser reads the same lines for
//! comparison.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Quat, Vec3};
use osp_session::recording::{Author, Event, Flush, Header, OpenOptions, RonReader, RonWriter, StrokeId};

const EVENTS: u32 = 20_000;

/// Returns a recording with two control points for each head pose. Its numbers have as many digits as the numbers of
/// real trackers.
fn recording() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer =
        RonWriter::new(&mut bytes, "bench", &Header::new("bench", ""), Flush::AtEnd).expect("a header");
    for i in 0..EVENTS {
        let t = f64::from(i) / 90.0;
        let angle = i as f32 * 0.37;
        let p = Vec3::new(angle.sin(), 1.5 + 0.3 * (angle * 0.7).cos(), angle.cos());
        let q = Quat::from_rotation_y(angle);
        let event = match i % 3 {
            0 => Event::Head { author: Author::SOLE, t, p, q },
            _ => Event::Point { t, stroke: StrokeId(i / 40), p, q, pressure: angle.sin().abs() },
        };
        writer.write(&event).expect("an event");
    }
    drop(writer);
    bytes
}

fn reading(c: &mut Criterion) {
    let bytes = recording();
    let text = std::str::from_utf8(&bytes).expect("text");
    let lines: Vec<&str> = text.lines().skip(1).collect();
    let mut group = c.benchmark_group("reading");
    group.throughput(Throughput::Elements(u64::from(EVENTS)));
    group.bench_function("RonReader", |b| {
        b.iter(|| {
            let mut reader = RonReader::new(&bytes[..], "bench", OpenOptions::default()).expect("a header");
            let mut count = 0;
            while let Some(event) =
                osp_session::recording::EventSource::next_event(&mut reader).expect("an event")
            {
                std::hint::black_box(&event);
                count += 1;
            }
            assert_eq!(count, EVENTS);
        });
    });
    group.bench_function("ron::from_str", |b| {
        b.iter(|| {
            for line in &lines {
                std::hint::black_box(&ron::from_str::<Event>(line).expect("an event"));
            }
        });
    });
    group.finish();
    let mut group = c.benchmark_group("writing");
    group.throughput(Throughput::Elements(u64::from(EVENTS)));
    let events: Vec<Event> = lines.iter().map(|line| ron::from_str(line).expect("an event")).collect();
    group.bench_function("RonWriter", |b| {
        let mut out = Vec::with_capacity(bytes.len());
        b.iter(|| {
            out.clear();
            let mut writer =
                RonWriter::new(&mut out, "b", &Header::new("b", ""), Flush::AtEnd).expect("a header");
            events.iter().for_each(|event| writer.write(event).expect("an event"));
        });
    });
    group.finish();
}

criterion_group!(benches, reading);
criterion_main!(benches);

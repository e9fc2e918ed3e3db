//! Motions for `phiw next` with one thing wrong: a robot would run them.

use super::bytes;
use super::case::{Case, Class, Expectation};
use super::ground::Ground;
use super::table::Table;
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// The classes.
pub fn classes() -> Vec<Class> {
    vec![
        Class::wrong("motions whose stamps contradict their velocities", 80, stamps),
        Class::wrong("motions whose positions contradict their velocities", 80, positions),
        Class::wrong("motions with a jump", 80, jumps),
        Class::new("bytes of a motion damaged", 100, damaged),
    ]
}

fn case(
    ground: &Ground,
    random: &mut ChaCha8Rng,
    expectation: Expectation,
    change: impl FnOnce(&mut Table) -> String,
) -> Case {
    let name = format!("motions/m{}.csv", random.random_range(0..6));
    let mut table = ground.table(&name);
    let story = format!("{name}: {}", change(&mut table));
    Case::new(ground, "next", expectation, story).file(&name, table.text())
}

fn stamps(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let factor = *[1e-3, 1e3, 0.1, 10.0, 0.25, 4.0, 1e-6].choose(random).unwrap_or(&1e3);
    case(ground, random, Expectation::Refused, |table| {
        table.map(0, |_, t| t * factor);
        format!("stamps × {factor}")
    })
}

fn positions(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let factor = *[57.295_779_513, 1000.0, -1.0, 0.1, 0.0].choose(random).unwrap_or(&1000.0);
    let prefix = *["q.", "qd.", "qdd."].choose(random).unwrap_or(&"q.");
    let joint = random.random_range(0..4);
    case(ground, random, Expectation::Refused, |table| {
        let column = table.columns(prefix)[joint];
        table.map(column, |_, value| value * factor);
        format!("{} × {factor}", table.header[column])
    })
}

fn jumps(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    // As many small jumps as large ones, to either side.
    let size =
        0.02 * 150_f64.powf(random.random_range(0.0..1.0)) * *[-1.0, 1.0].choose(random).unwrap_or(&1.0);
    let joint = random.random_range(0..4);
    let row = random.random_range(50..450);
    let length = if random.random_bool(0.5) { 1 } else { random.random_range(2..300) };
    case(ground, random, Expectation::Refused, |table| {
        let column = table.columns("q.")[joint];
        table.map(column, |at, q| if (row..row + length).contains(&at) { q + size } else { q });
        format!("{} jumps by {size:.3} for {length} rows", table.header[column])
    })
}

fn damaged(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let name = format!("motions/m{}.csv", random.random_range(0..6));
    let (bytes, story) = bytes::damage(ground.file(&name), random);
    Case::new(ground, "next", Expectation::Orderly, format!("{name}: {story}")).file(&name, bytes)
}

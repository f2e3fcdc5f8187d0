//! Which numbers are read where they are used.

use super::{Body, Instructions, Item, Signed, Step};
use crate::jit::vectors::{Lanes, Width};
use crate::lower::{Array, Operation, Place};

fn entry(run: usize, at: usize, stride: usize) -> Place<()> {
    Place::moving(Array::Rows(run), at, (), stride)
}

/// Whether a number is read where it is used.
fn in_place(body: &Body, of: Signed) -> bool {
    body.items.iter().any(|item| matches!(item, Item::Value(id, Step::Again(_)) if *id == of.id))
}

#[test]
fn numbers_are_read_where_they_are_used_if_they_are_still_there() {
    let mut body = Body::new(false, Width { states: Lanes::One, wide: false }, 1);
    let start = [1.0, 2.0].map(|x| body.constant(x));
    let (open, (), carried) = body.open_loop(3, false, start.to_vec());
    let places = [entry(0, 0, 8), entry(0, 1, 8), entry(0, 2, 8), entry(1, 0, 8), entry(1, 1, 8)];
    let [stays, written, before, other, early] = places.map(|place| body.load(place));
    // Used before anything is written to their arrays.
    let sum = body.operation(Operation::Add(before, early));
    body.store(entry(0, 1, 8), sum);
    body.store(entry(0, 2, 8), sum);
    // Entries that move by another distance may be any of the others.
    body.store(entry(1, 5, 4), sum);
    let sum = body.operation(Operation::Add(stays, written));
    let sum = body.operation(Operation::Add(sum, other));
    body.store(entry(2, 0, 8), sum);
    // They change places: the first is overwritten before it becomes the second.
    body.close_loop(open, vec![carried[1], carried[0]]);
    let outside = body.load(Place::fixed(Array::Kept, 0));
    body.store(Place::fixed(Array::Result(0), 0), outside);
    body.read_in_place();
    let found = [stays, written, before, other, early, carried[0], carried[1], outside].map(|x| in_place(&body, x));
    assert_eq!(found, [true, false, true, false, true, false, true, true]);
}

/// Sines of vectors of two are computed by as many at once as the longest vector has room for: of six vectors, in vectors of eight
/// and of four numbers, or in three of four.
#[test]
fn sines_of_short_vectors_are_computed_together() {
    for (wide, expected) in [(true, vec![8, 4]), (false, vec![4, 4, 4])] {
        let mut body = Body::new(true, Width { states: Lanes::One, wide }, 2);
        body.vectors(true);
        let angles: Vec<Signed> = (0..6).map(|at| body.load(Place::fixed(Array::Kept, 2 * at))).collect();
        let pairs = body.sines(&angles);
        let lengths = body.items.iter().filter_map(|item| match item {
            Item::CallIfSigns(beyond, _) => Some(body.lanes[*beyond as usize].count()),
            _ => None,
        });
        assert_eq!(lengths.collect::<Vec<_>>(), expected);
        let place = |of: &Signed| {
            body.items.iter().find_map(|item| match item {
                Item::Value(id, Step::Again(entry)) if *id == of.id => Some(entry.at),
                _ => None,
            })
        };
        // Each sine has a place of its own, two entries after the one before it in the same vector.
        let sines: Vec<usize> = pairs.iter().map(|[sin, _]| place(sin).expect("is read from memory")).collect();
        let in_one = expected[0] / 2;
        assert!((1..in_one).all(|k| sines[k] == sines[0] + 2 * k), "{sines:?}");
        assert!(pairs.iter().flatten().all(|x| body.lanes[x.id as usize] == Lanes::Two));
    }
}

//! Lists of elementary transforms that contain those of several placements.

use mbd_runtime::spatial::ElementaryTransform;

use super::super::runs::same_step;

/// The steps of a placement.
pub type Steps = Vec<ElementaryTransform<f64>>;

/// The shortest list that contains both in order, if what either lacks can be let in.
pub fn union(a: &[ElementaryTransform<f64>], b: &[ElementaryTransform<f64>], turns: bool) -> Option<Steps> {
    let (Some((x, rest_of_a)), Some((y, rest_of_b))) = (a.split_first(), b.split_first()) else {
        let rest = [a, b].concat();
        return rest.iter().all(|step| identity(step, turns).is_some()).then_some(rest);
    };
    let after = |step: &ElementaryTransform<f64>, rest: Option<Steps>| Some([vec![*step], rest?].concat());
    if same_step(x, y) {
        return after(x, union(rest_of_a, rest_of_b, turns));
    }
    let without = |step, rest| identity(step, turns).and_then(|_| after(step, rest));
    let ways = [without(x, union(rest_of_a, b, turns)), without(y, union(a, rest_of_b, turns))];
    ways.into_iter().flatten().min_by_key(Vec::len)
}

/// The step that does nothing in the place of another one. A shift by zero is exact.
fn identity(step: &ElementaryTransform<f64>, turns: bool) -> Option<ElementaryTransform<f64>> {
    match *step {
        ElementaryTransform::Shift { axis, .. } => Some(ElementaryTransform::Shift { axis, r: 0.0 }),
        ElementaryTransform::Turn { axis, .. } if turns => Some(ElementaryTransform::Turn { axis, c: 1.0, s: 0.0 }),
        ElementaryTransform::Turn { .. } | ElementaryTransform::Rotate(_) => None,
    }
}

/// A placement with the steps of a longer one.
pub fn padded(place: &[ElementaryTransform<f64>], steps: &[ElementaryTransform<f64>], turns: bool) -> Option<Steps> {
    let Some((step, others)) = steps.split_first() else { return place.is_empty().then(Vec::new) };
    let taken = place.split_first().filter(|(own, _)| same_step(own, step));
    let with = |own: ElementaryTransform<f64>, rest: Steps| [vec![own], rest].concat();
    let as_is = taken.and_then(|(own, rest)| Some(with(*own, padded(rest, others, turns)?)));
    as_is.or_else(|| Some(with(identity(step, turns)?, padded(place, others, turns)?)))
}

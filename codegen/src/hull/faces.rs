//! The faces and edges of a convex polyhedron, from its corners.

use std::collections::BTreeMap;

use mbd_runtime::hull::{Edge, Face, Plane, Polyhedron};

use super::{distinct, minus, scaled, Vec3, EXACT};
use crate::inertia::{cross, dot, unit};
use crate::known::Known;

/// Points nearer to the plane of a face than this are on it, in units of the longest extent along an axis: rounding.
const FLAT: f64 = 1e-12;

/// Corners up to which faces are looked for, which takes a time that grows with the cube of their number.
const MOST: usize = 500;

/// The polyhedron of points that are its corners. `None` where they lie on a line or are more than 500, where rounding does not
/// tell which of them are on one face, and where areas between them have no finite squares. Equal ones exist once, for as long
/// as the program runs.
pub(crate) fn polyhedron(corners: &[Vec3]) -> Option<&'static Polyhedron> {
    if corners.len() > MOST {
        return None;
    }
    static ALL: Known<Vec<u64>, Option<&Polyhedron>> = Known::new();
    let bits = corners.iter().flatten().map(|x| x.to_bits()).collect();
    ALL.get(bits, || made(corners).map(|made| &*Box::leak(Box::new(made))))
}

/// Some of the corners, in a plane that has the others behind it.
struct Side {
    on: Vec<usize>,
    normal: Vec3,
    /// Of the triangle that the normal was taken of.
    area: f64,
}

fn made(corners: &[Vec3]) -> Option<Polyhedron> {
    let mut faces = Vec::new();
    // The ends of each edge, and the number of faces that it was met on.
    let mut edges: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    for Side { on, normal, .. } in sides(corners) {
        let mut around = Vec::new();
        for (i, j) in on.iter().flat_map(|i| on.iter().map(move |j| (*i, *j))).filter(|(i, j)| i != j) {
            let out = cross(minus(&corners[j], &corners[i]), normal);
            let others = on.iter().filter(|k| **k != i && **k != j);
            if others.into_iter().all(|k| dot(minus(&corners[*k], &corners[i]), out) < 0.0) {
                let out = unit(out);
                around.push(Plane { normal: out, height: dot(corners[i], out) });
                *edges.entry([i.min(j), i.max(j)]).or_default() += 1;
            }
        }
        // As many sides as corners: they go round it.
        if around.len() != on.len() {
            return None;
        }
        let plane = Plane { normal, height: dot(corners[*on.first()?], normal) };
        faces.push(Face { plane, sides: Box::leak(around.into_boxed_slice()) });
    }
    // Every edge has a face on either side, and Euler's formula says that nothing is missing.
    if faces.is_empty() || edges.values().any(|n| *n != 2) || corners.len() + faces.len() != edges.len() + 2 {
        return None;
    }
    let edge = |[i, j]: &[usize; 2]| {
        let (a, b) = (&corners[*i], &corners[*j]);
        let way = minus(b, a);
        let middle = [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]));
        Edge { middle, axis: unit(way), length: dot(way, way).sqrt() }
    };
    let edges: Vec<Edge> = edges.keys().map(edge).collect();
    let radius = corners.iter().fold(0.0, |most: f64, p| most.max(dot(*p, *p))).sqrt();
    Some(Polyhedron { faces: Box::leak(faces.into_boxed_slice()), edges: Box::leak(edges.into_boxed_slice()), radius })
}

/// The planes through three corners or more that have none before them. Of the triangles in a plane, the largest one gives its
/// normal.
fn sides(corners: &[Vec3]) -> Vec<Side> {
    let (n, order) = (corners.len(), distinct(corners));
    let (_, size) = scaled(corners, &order);
    let mut found: Vec<Side> = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            for c in b + 1..n {
                let across = cross(minus(&corners[b], &corners[a]), minus(&corners[c], &corners[a]));
                let area = dot(across, across).sqrt();
                // Products of numbers that are too large tell nothing.
                if !area.is_finite() {
                    return Vec::new();
                }
                if area <= EXACT * size * size {
                    continue;
                }
                for way in [1.0 / area, -1.0 / area] {
                    let normal = across.map(|x| way * x);
                    let height = |k: &usize| dot(minus(&corners[*k], &corners[a]), normal);
                    if (0..n).any(|k| height(&k) > FLAT * size) {
                        continue;
                    }
                    let on: Vec<usize> = (0..n).filter(|k| height(k) >= -FLAT * size).collect();
                    match found.iter_mut().find(|side| side.on == on && dot(side.normal, normal) > 0.0) {
                        None => found.push(Side { on, normal, area }),
                        Some(side) if side.area < area => (side.normal, side.area) = (normal, area),
                        Some(_) => {}
                    }
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::tests::Draw;
    use super::*;

    /// Polyhedra of random points have triangles, as many as Euler's formula says, with all corners behind them; a turned
    /// cuboid has six faces with four sides, a plate one for either side, a line none.
    #[test]
    fn faces_have_all_corners_behind_them() {
        let mut draw = Draw(4);
        for n in [4, 8, 20] {
            let points: Vec<Vec3> = (0..n).map(|_| unit(draw.point())).collect();
            let solid = polyhedron(&points).expect("faces");
            assert_eq!([solid.faces.len(), solid.edges.len()], [2 * n - 4, 3 * n - 6]);
            for face in solid.faces {
                let height = |p: &Vec3| dot(*p, face.plane.normal) - face.plane.height;
                assert!(points.iter().all(|p| height(p) < 1e-14), "{n}");
                assert_eq!(points.iter().filter(|p| height(p) > -1e-14).count(), face.sides.len());
                for side in face.sides {
                    assert!(dot(side.normal, face.plane.normal).abs() < 1e-15);
                }
            }
            assert!(std::ptr::eq(polyhedron(&points).expect("the same one"), solid));
        }
        let axes = {
            let x = unit(draw.point());
            let y = unit(cross(x, draw.point()));
            [x, y, cross(x, y)]
        };
        let at = |p: Vec3| [0, 1, 2].map(|i| 0.3 + (0..3).map(|j| axes[j][i] * p[j]).sum::<f64>());
        let corner = |k: usize| [0, 1, 2].map(|i| if k >> i & 1 == 0 { 0.0 } else { [0.3, 0.5, 0.1][i] });
        let cuboid: Vec<Vec3> = (0..8).map(|k| at(corner(k))).collect();
        let solid = polyhedron(&cuboid).expect("faces");
        assert_eq!([solid.faces.len(), solid.edges.len()], [6, 12]);
        assert!(solid.faces.iter().all(|face| face.sides.len() == 4));
        let plate = polyhedron(&cuboid[..4]).expect("two faces");
        assert_eq!([plate.faces.len(), plate.edges.len()], [2, 4]);
        assert_eq!(polyhedron(&cuboid[..2]), None);
        // A fuzzer's: more corners than would be done in a day if each plane through three of them counted as a face.
        for size in [1e100, 1e160, 1e300] {
            let far: Vec<Vec3> = (0..400).map(|_| unit(draw.point()).map(|x| size * x)).collect();
            assert_eq!(polyhedron(&far), None, "{size:e}");
        }
        assert_eq!(polyhedron(&[]), None);
    }
}

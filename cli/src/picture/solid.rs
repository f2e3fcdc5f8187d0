//! Triangles of solids: of bodies whose points are known, and of shapes.

use std::collections::BTreeMap;

use multibody::codegen::model::ShapeKind;

use super::touch::{across, ellipsoid};

type Vec3 = [f64; 3];

/// Triangles, three corners each: place, m, and normal.
pub type Mesh = Vec<[f32; 6]>;

/// Corners around a cylinder.
const AROUND: usize = 48;

fn corner(place: Vec3, normal: Vec3) -> [f32; 6] {
    let [x, y, z] = place;
    let [u, v, w] = normal;
    [x, y, z, u, v, w].map(|x| x as f32)
}

fn unit(a: Vec3) -> Vec3 {
    let norm = a.iter().fold(0.0_f64, |n, x| n.hypot(*x)).max(f64::MIN_POSITIVE);
    a.map(|x| x / norm)
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Directions all around, and the triangles between neighbours.
pub struct Directions {
    ways: Vec<Vec3>,
    faces: Vec<[usize; 3]>,
}

impl Default for Directions {
    fn default() -> Self {
        Directions::new(3)
    }
}

impl Directions {
    /// The corners of an icosahedron whose faces are divided into four, so many times.
    pub fn new(divisions: usize) -> Directions {
        let g = 0.5 * (1.0 + 5.0_f64.sqrt());
        let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
        let corners = signs.into_iter().flat_map(|[a, b]| [[0.0, a, b * g], [a, b * g, 0.0], [b * g, 0.0, a]]);
        let mut all = Directions { ways: corners.map(unit).collect(), faces: Vec::new() };
        // Neighbours are the nearest.
        let near = |a: usize, b: usize| (0..3).map(|k| all.ways[a][k] * all.ways[b][k]).sum::<f64>() > 0.4;
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    if near(a, b) && near(b, c) && near(a, c) {
                        let way = cross(all.ways[a], all.ways[b]);
                        let right = (0..3).map(|k| way[k] * all.ways[c][k]).sum::<f64>() > 0.0;
                        all.faces.push(if right { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
        }
        (0..divisions).for_each(|_| all.divide());
        all
    }

    fn divide(&mut self) {
        let mut known = BTreeMap::new();
        let ways = &mut self.ways;
        let mut middle = |a: usize, b: usize| {
            *known.entry((a.min(b), a.max(b))).or_insert_with(|| {
                ways.push(unit(std::array::from_fn(|k| ways[a][k] + ways[b][k])));
                ways.len() - 1
            })
        };
        let divided = self.faces.iter().flat_map(|&[a, b, c]| {
            let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        });
        self.faces = divided.collect();
    }

    /// The hull of some points, thickened by a radius, m: the farthest point in every direction, which is its normal.
    pub fn hull(&self, points: &[Vec3], radius: f64) -> Mesh {
        let far = |way: &Vec3| {
            let along = |p: &Vec3| (0..3).map(|k| p[k] * way[k]).sum::<f64>();
            let best = points.iter().max_by(|a, b| along(a).total_cmp(&along(b))).copied().unwrap_or_default();
            corner(std::array::from_fn(|k| best[k] + radius * way[k]), *way)
        };
        let far: Vec<[f32; 6]> = self.ways.iter().map(far).collect();
        self.faces.iter().flatten().map(|k| far[*k]).collect()
    }

    /// A shape in its own axes; none of points and planes.
    pub fn shape(&self, kind: &ShapeKind) -> Mesh {
        match *kind {
            ShapeKind::Sphere { radius } => self.hull(&[[0.0; 3]], radius),
            ShapeKind::Ellipsoid { semi_axes } => self.hull(&ellipsoid([0.0; 3], semi_axes), 0.0),
            ShapeKind::Capsule { radius, length } => {
                self.hull(&[[0.0, 0.0, 0.5 * length], [0.0, 0.0, -0.5 * length]], radius)
            }
            ShapeKind::Box { size, .. } => cuboid(size),
            ShapeKind::Cylinder { radius, length, .. } => cylinder(radius, length.max(0.02 * radius)),
            ShapeKind::Hull { ref points, rounding } => self.hull(points, rounding),
            // Points, planes and height fields.
            _ => Mesh::new(),
        }
    }
}

fn cuboid(size: Vec3) -> Mesh {
    let mut mesh = Mesh::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let normal: Vec3 = std::array::from_fn(|k| if k == axis { side } else { 0.0 });
            let [u, v] = across(normal);
            for [a, b] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
                mesh.push(corner(std::array::from_fn(|k| 0.5 * size[k] * (normal[k] + a * u[k] + b * v[k])), normal));
            }
        }
    }
    mesh
}

fn cylinder(radius: f64, length: f64) -> Mesh {
    let mut mesh = Mesh::new();
    let at = |k: usize| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / AROUND as f64).sin_cos();
        [c, s]
    };
    for k in 0..AROUND {
        let ([c, s], [d, t]) = (at(k), at(k + 1));
        let rim = |[c, s]: [f64; 2], z: f64| [radius * c, radius * s, 0.5 * z * length];
        let side = |p: [f64; 2], z: f64| corner(rim(p, z), [p[0], p[1], 0.0]);
        let (a, b) = ([c, s], [d, t]);
        mesh.extend([side(a, -1.0), side(b, -1.0), side(b, 1.0), side(a, -1.0), side(b, 1.0), side(a, 1.0)]);
        for z in [-1.0, 1.0] {
            let (first, second) = if z > 0.0 { (a, b) } else { (b, a) };
            let lid = |p: Vec3| corner(p, [0.0, 0.0, z]);
            mesh.extend([lid([0.0, 0.0, 0.5 * z * length]), lid(rim(first, z)), lid(rim(second, z))]);
        }
    }
    mesh
}

/// An outline in a plane, its corners in order, seen from both sides.
pub fn plate(points: &[Vec3]) -> Mesh {
    let [first, second, ..] = points else { return Mesh::new() };
    let minus = |a: &Vec3, b: &Vec3| std::array::from_fn(|k| a[k] - b[k]);
    let normal = unit(cross(minus(second, first), minus(&points[points.len() / 2], first)));
    let other = normal.map(|x| -x);
    let fan = points.windows(2).skip(1).flat_map(|pair| {
        let ([a, b], [n, m]) = ([pair[0], pair[1]], [normal, other]);
        [corner(*first, n), corner(a, n), corner(b, n), corner(*first, m), corner(b, m), corner(a, m)]
    });
    fan.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume inside a mesh, by the divergence theorem.
    fn volume(mesh: &Mesh) -> f64 {
        let place = |c: &[f32; 6]| [c[0], c[1], c[2]].map(f64::from);
        mesh.chunks(3)
            .map(|t| {
                let (a, n) = (place(&t[0]), cross(place(&t[1]), place(&t[2])));
                (0..3).map(|k| a[k] * n[k]).sum::<f64>() / 6.0
            })
            .sum()
    }

    #[test]
    fn volumes_of_solids() {
        let all = Directions::default();
        assert_eq!((all.ways.len(), all.faces.len()), (642, 1280));
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        for (kind, exact) in [
            (ShapeKind::Sphere { radius: 1.0 }, ball),
            (ShapeKind::Box { size: [1.0, 2.0, 3.0], rounding: 0.0 }, 6.0),
            (ShapeKind::Cylinder { radius: 1.0, length: 2.0, sides: None, rounding: 0.0 }, 2.0 * std::f64::consts::PI),
            (ShapeKind::Capsule { radius: 1.0, length: 2.0 }, ball + 2.0 * std::f64::consts::PI),
            (ShapeKind::Ellipsoid { semi_axes: [1.0, 2.0, 0.5] }, ball),
            (
                ShapeKind::Hull {
                    points: vec![[0.0; 3], [6.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                    rounding: 0.0,
                },
                1.0,
            ),
        ] {
            let found = volume(&all.shape(&kind));
            // Corners on the surface leave out a few percent.
            assert!(found > 0.95 * exact && found < 1.0001 * exact, "{kind:?}: {found}, {exact}");
        }
        let cube: Vec<Vec3> = (0..8).map(|k| [0, 1, 2].map(|i| f64::from(k >> i & 1))).collect();
        assert!((volume(&all.hull(&cube, 0.0)) - 1.0).abs() < 1e-6);
    }
}

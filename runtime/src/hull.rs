//! Convex polyhedra, in whose axes their numbers are.

/// A convex polyhedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polyhedron {
    /// Its faces; of a plate, one for either side.
    pub faces: &'static [Face],
    /// Its edges.
    pub edges: &'static [Edge],
    /// Largest distance of a corner from the origin, m.
    pub radius: f64,
}

/// A face of a convex polyhedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Its plane; the normal points out of the polyhedron.
    pub plane: Plane,
    /// The planes across it through its sides; their normals point away from the face.
    pub sides: &'static [Plane],
}

/// A plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: [f64; 3],
    /// Distance from the origin along the normal, m.
    pub height: f64,
}

/// A straight edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Its middle, m.
    pub middle: [f64; 3],
    /// Its direction, a unit vector.
    pub axis: [f64; 3],
    /// Its length, m.
    pub length: f64,
}

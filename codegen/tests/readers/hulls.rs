//! Hulls of points and of meshes.

use std::io::{Error, ErrorKind};
use std::path::Path;

use mbd_codegen::diag::Diagnostics;
use mbd_codegen::model::{Model, ShapeKind};
use mbd_codegen::read::{load_with, to_toml, Base, Floor, ImportOptions};
use mbd_runtime::Scalar;

/// The corners of a box of edges 2, 4 and 6, x changing fastest, as those of boxes are numbered.
fn corners() -> Vec<[f64; 3]> {
    (0..8).map(|k: i32| [0, 1, 2].map(|i| f64::from(i + 1) * if k >> i & 1 == 0 { -1.0 } else { 1.0 })).collect()
}

/// The triangles of the hull of these corners, with the middles of all edges and faces: as in meshes, most points are no
/// corners, and each is there several times.
fn triangles() -> Vec<[[f64; 3]; 3]> {
    let mut all = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let at = |a: i32, b: i32| {
                let mut point = [0.0; 3];
                point[axis] = side;
                point[(axis + 1) % 3] = f64::from(a);
                point[(axis + 2) % 3] = f64::from(b);
                [0, 1, 2].map(|k| point[k] * (k + 1) as f64)
            };
            for (a, b) in [(-1, -1), (0, -1), (-1, 0), (0, 0)] {
                all.push([at(a, b), at(a + 1, b), at(a, b + 1)]);
                all.push([at(a + 1, b + 1), at(a, b + 1), at(a + 1, b)]);
            }
        }
    }
    all
}

fn binary(triangles: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(u32::try_from(triangles.len()).expect("few").to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn text(triangles: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let vertex = |[x, y, z]: &[f64; 3]| format!("      vertex {x:e} {y:e} {z:e}\n");
    let facet = |t: &[[f64; 3]; 3]| {
        let corners: String = t.iter().map(vertex).collect();
        format!("  facet normal 0 0 0\n    outer loop\n{corners}    endloop\n  endfacet\n")
    };
    format!("solid box\n{}endsolid box\n", triangles.iter().map(facet).collect::<String>()).into_bytes()
}

fn obj(triangles: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut text = String::from("# a box\n");
    for [x, y, z] in triangles.iter().flatten() {
        text += &format!("v {x} {y} {z} 1.0\n");
    }
    (0..triangles.len()).for_each(|k| text += &format!("f {}//1 {}//1 -1\n", 3 * k + 1, 3 * k + 2));
    text.into_bytes()
}

fn model(shape: &str) -> String {
    format!(
        "[[body]]\nname = 'crate'\nmass = 1\ninertia = [1, 1, 1]\n[[joint]]\nname = 'j'\ntype = 'floating'\nchild = 'crate'\n\
         [[shape]]\nname = 'floor'\ntype = 'plane'\n[[shape]]\nname = 'solid'\nbody = 'crate'\nxyz = [0.1, 0.2, 0.3]\n\
         rotate = {{ axis = [1, 2, 3], angle = 0.4 }}\n{shape}\n\
         [[contact]]\nname = 'c'\nbetween = ['floor', 'solid']\nfriction = 0.5\n"
    )
}

/// Reads a model in the folder `robots`, beside which there is a mesh.
fn read(text: &str, mesh: &[u8]) -> (Option<Model>, Diagnostics) {
    let files = |path: &Path| match path.parent() == Some(Path::new("robots/meshes")) {
        true => Ok(mesh.to_vec()),
        false => Err(Error::from(ErrorKind::NotFound)),
    };
    let (read, findings) = load_with("robots/m.toml", text, &ImportOptions::default(), &files);
    (read.map(|(model, _)| model), findings)
}

fn clean(text: &str, mesh: &[u8]) -> (Model, String) {
    let (model, findings) = read(text, mesh);
    (model.unwrap_or_else(|| panic!("{findings}")), findings.to_string())
}

/// Contacts without the places of their descriptions, which differ.
fn contacts(model: &Model) -> Vec<String> {
    model.contacts.iter().map(|c| format!("{} {:?} {} {:?}", c.name, c.kind, c.friction, c.shapes)).collect()
}

#[test]
fn a_hull_of_the_corners_of_a_box_has_the_contacts_of_the_box() {
    let (boxed, _) = clean(&model("type = 'box'\nsize = [2, 4, 6]"), &[]);
    assert_eq!(contacts(&boxed).len(), 8);
    let (hull, findings) = clean(&model(&format!("type = 'hull'\npoints = {:?}", corners())), &[]);
    assert_eq!((contacts(&hull), findings.as_str()), (contacts(&boxed), ""));
    // Points inside, on faces and on edges change nothing.
    let inside = [[0.0; 3], [1.0, 0.5, 0.3], [0.0, 2.0, 3.0], [0.0, 2.0, 0.0]];
    let all: Vec<[f64; 3]> = inside.into_iter().chain(corners()).collect();
    let (hull, findings) = clean(&model(&format!("type = 'hull'\npoints = {all:?}")), &[]);
    assert_eq!(contacts(&hull), contacts(&boxed));
    assert_eq!(
        findings,
        "robots/m.toml:18:10: notice: shape `solid`: 4 of its 12 points lie within the hull of the others"
    );
}

#[test]
fn meshes_of_a_box_have_its_corners() {
    let all = triangles();
    assert_eq!(all.len(), 48);
    let mut found = Vec::new();
    for (name, bytes) in [("box.stl", binary(&all)), ("box.STL", text(&all)), ("box.obj", obj(&all))] {
        let (m, findings) = clean(&model(&format!("type = 'hull'\nfile = 'meshes/{name}'")), &bytes);
        assert!(findings.contains(&format!("`meshes/{name}` has 144 points; their hull has 8 corners")), "{findings}");
        let ShapeKind::Hull { points, .. } = &m.shapes[1].kind else { panic!("no hull") };
        let mut sorted = points.clone();
        sorted.sort_by(|a, b| a.iter().rev().partial_cmp(b.iter().rev()).expect("numbers"));
        assert_eq!(sorted, corners());
        found.push(points.clone());
        let (scaled, _) = clean(&model(&format!("type = 'hull'\nfile = 'meshes/{name}'\nscale = 0.001")), &bytes);
        let small: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| x * 0.001)).collect();
        assert_eq!(scaled.shapes[1].kind, ShapeKind::Hull { points: small, rounding: 0.0 });
    }
    assert!(found.iter().all(|points| *points == found[0]));
}

/// A converted model has the corners, without the mesh.
#[test]
fn hulls_are_converted() {
    let files = |_: &Path| Ok(binary(&triangles()));
    let text = model("type = 'hull'\nfile = 'box.stl'");
    let (converted, _) = to_toml("m.toml", &text, &ImportOptions::default(), &files).expect("a model");
    let none = |_: &Path| Err(Error::from(ErrorKind::NotFound));
    let read = |text: &str, files| load_with("m.toml", text, &ImportOptions::default(), files).0.expect("a model").0;
    assert_eq!(read(&converted, &none).shapes, read(&text, &files).shapes);
}

/// The number of corners is bounded, and how much the hull loses is told.
#[test]
fn corners_are_few() {
    let point = |k: i32| {
        let (z, angle) = (1.0 - 2.0 * (f64::from(k) + 0.5) / 500.0, 2.4 * f64::from(k));
        let r = (1.0 - z * z).sqrt();
        let (sin, cos) = Scalar::sin_cos(angle);
        [r * cos, r * sin, z]
    };
    let points: Vec<[f64; 3]> = (0..500).map(point).collect();
    for (most, wanted) in [("", 32), ("most = 4", 4), ("most = 256", 256)] {
        let (m, findings) = clean(&model(&format!("type = 'hull'\npoints = {points:?}\n{most}")), &[]);
        assert_eq!(m.contacts.len(), wanted);
        let told = format!("{wanted} of its 500 points are used; the others lie up to ");
        let depth = findings.split(&told).nth(1).and_then(|rest| rest.split(" mm").next()?.parse::<f64>().ok());
        let depth = depth.unwrap_or_else(|| panic!("{findings}"));
        // A cap of a ball that holds its share of the surface is deep by twice that; corners are not evenly spread.
        let even = 2000.0 / wanted as f64;
        assert!(depth > even && depth < 3.0 * even, "{wanted}: {depth} mm");
    }
}

/// Every way to damage a mesh has a finding, and none a panic.
#[test]
fn damaged_meshes_are_refused() {
    let said = |name: &str, bytes: &[u8], wanted: &str| {
        let (m, findings) = read(&model(&format!("type = 'hull'\nfile = 'meshes/{name}'")), bytes);
        assert!(m.is_none() && findings.has_errors(), "{name}: {wanted}");
        assert!(findings.to_string().contains(wanted), "{wanted}\n{findings}");
    };
    let whole = binary(&triangles());
    const SIZE: &str = "robots/m.toml:18:8: error: shape `solid`: `meshes/m.stl`: the STL file has another size";
    for end in (0..whole.len()).step_by(7) {
        said("m.stl", &whole[..end], SIZE);
    }
    for count in [0_u32, 47, 49, 1_000_000_000, u32::MAX] {
        let mut bytes = whole.clone();
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        said("m.stl", &bytes, SIZE);
    }
    for x in [f32::NAN, f32::INFINITY] {
        let mut bytes = whole.clone();
        bytes[96..100].copy_from_slice(&x.to_le_bytes());
        said("m.stl", &bytes, "1 of the 144 points of the mesh are not finite");
    }
    let mut bytes = whole.clone();
    bytes[96..100].copy_from_slice(&f32::MAX.to_le_bytes());
    said("m.stl", &bytes, "1 of its points are farther away than 1e9 m");

    let whole = String::from_utf8(text(&triangles())).expect("text");
    for end in (5..whole.len() - 9).step_by(13) {
        said("m.stl", &whole.as_bytes()[..end], "error: shape `solid`: ");
    }
    let damaged =
        whole.replacen("vertex", "vertex x", 1).replacen("endloop", "endlop", 1).replacen("vertex -1e0", "#", 1);
    said(
        "m.stl",
        damaged.as_bytes(),
        "robots/meshes/m.stl:4:7: error: shape `solid`: `vertex` needs three finite numbers",
    );
    said("m.stl", damaged.as_bytes(), "robots/meshes/m.stl:7:5: error: shape `solid`: this is no line of an STL file");
    said("m.stl", damaged.as_bytes(), "a facet needs three vertices");
    let many = whole.replace("vertex", "vertx");
    let (_, findings) = read(&model("type = 'hull'\nfile = 'meshes/m.stl'"), many.as_bytes());
    assert_eq!(findings.0.len(), 11);
    assert!(findings.to_string().contains("`meshes/m.stl`: 182 more of such lines"), "{findings}");

    for (bytes, wanted) in [
        (&b"v 1 2\n"[..], "meshes/m.obj:1:1: error: shape `solid`: `v` needs three finite numbers"),
        (b"v 1 2 3\n  v 1 nan 3", "meshes/m.obj:2:3: error: shape `solid`: `v` needs three finite numbers"),
        (b"v 1 2 1e999", "`v` needs three finite numbers"),
        (b"v 1 2 3\nf 1 2 3\n", "meshes/m.obj:2:1: error: shape `solid`: a face has a vertex that there is not"),
        (b"v 1 2 3\nf 0 1 1", "`f` needs numbers of vertices"),
        (b"v 1 2 3\nf -9223372036854775808 1 1", "`f` needs numbers of vertices"),
        (b"f a b c", "`f` needs numbers of vertices"),
        (b"", "the mesh has no points"),
        (b"\xff\xfe", "the OBJ file is no text"),
    ] {
        said("m.obj", bytes, wanted);
    }
    said("m.dae", b"", "meshes are read from STL and OBJ files");
    // Of a file that is not there, the path is to be mended; of one that is damaged, the mesh.
    said(
        "../m.stl",
        b"",
        "`meshes/../m.stl`: it cannot be read: entity not found\n  help: the path is relative to the folder of this file",
    );
    said("m.obj", b"", "the mesh has no points\n  help: write the mesh anew by the program that made it");
}

#[test]
fn flat_meshes_are_warned_about() {
    let flat = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0.5 0.5 0\nf 1 2 3\n";
    let (m, findings) = clean(&model("type = 'hull'\nfile = 'meshes/plate.obj'"), flat);
    assert_eq!(m.contacts.len(), 4);
    assert!(findings.contains("warning: shape `solid`: its points lie in a plane"), "{findings}");
}

const ROBOT: &str = r#"<robot name='r'>
  <link name='base'>
    <collision><geometry><mesh filename='package://robot/meshes/box.stl' scale='-0.1 0.1 0.1'/></geometry></collision>
    <collision><geometry><mesh filename='../meshes/box.stl'/></geometry></collision>
    <collision><geometry><mesh filename='package://robot/meshes/none.stl'/></geometry></collision>
    <collision><geometry><mesh filename='package://robot/meshes/box.dae'/></geometry></collision>
    <collision><geometry><mesh filename='../meshes/bad.obj'/></geometry></collision>
    <collision><geometry><mesh filename='../meshes/box.stl' scale='1 0 1'/></geometry></collision>
    <collision><geometry><mesh/></geometry></collision>
    <inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>
  </link>
</robot>"#;

#[test]
fn meshes_of_robots_touch_the_floor() {
    let files = |path: &Path| match path.to_string_lossy().as_ref() {
        "robot/urdf/../meshes/box.stl" => Ok(binary(&triangles())),
        "robot/urdf/../meshes/bad.obj" => Ok(b"v 1 2 3\nv 1 2".to_vec()),
        _ => Err(Error::from(ErrorKind::NotFound)),
    };
    let floor = Some(Floor { height: 0.0, friction: 0.5 });
    let options = ImportOptions { base: Base::Floating, floor, ..ImportOptions::default() };
    let (read, findings) = load_with("robot/urdf/r.urdf", ROBOT, &options, &files);
    let (findings, model) = (findings.to_string(), read.expect("a model").0);
    assert_eq!(model.shapes.len(), 3);
    assert_eq!(model.contacts.len(), 16);
    let ShapeKind::Hull { points, .. } = &model.shapes[1].kind else { panic!("no hull") };
    assert!(points.contains(&[0.1, -2.0 * 0.1, 3.0 * 0.1]), "{points:?}");
    for wanted in [
        "notice: 2 meshes are hulls for contacts",
        "notice: `mesh` of a `collision` is not used: its file was not found",
        "notice: `mesh` of a `collision` is not used: only STL and OBJ files are read",
        "a `collision` is not used: `../meshes/bad.obj`: line 2: `v` needs three finite numbers (3 times, first here)",
    ] {
        assert!(findings.contains(wanted), "{wanted}\n{findings}");
    }
    // Without a floor, no file is read.
    let none = |path: &Path| panic!("{}", path.display());
    let options = ImportOptions { floor: None, ..options };
    let (read, findings) = load_with("robot/urdf/r.urdf", ROBOT, &options, &none);
    assert!(read.is_some_and(|(model, _)| model.shapes.is_empty()));
    assert!(
        findings
            .to_string()
            .contains("meshes are read where a floor or contacts between bodies are asked for (7 times"),
        "{findings}"
    );
}

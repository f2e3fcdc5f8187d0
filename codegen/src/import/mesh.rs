//! Readers of meshes: STL (binary or text) and OBJ files, MuJoCo's own MSH. Triangles for inertias, points for hulls.

/// Most triangles, and most points, of a mesh.
pub(crate) const MOST: usize = 2_000_000;

/// A triangle by its corners, in the unit of the file.
pub(crate) type Triangle = [[f64; 3]; 3];

/// What is wrong with a mesh, and where in a file of text: line and column from 1, 0 where the file has no lines.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Problem {
    pub line: usize,
    pub column: usize,
    pub message: String,
}

impl Problem {
    /// Of the file as a whole.
    pub fn whole(message: impl Into<String>) -> Vec<Problem> {
        vec![Problem { line: 0, column: 0, message: message.into() }]
    }
}

/// Triangles from indices of vertices.
pub(crate) fn corners(vertices: &[[f64; 3]], faces: impl Iterator<Item = [usize; 3]>) -> Result<Vec<Triangle>, String> {
    let mut all = Vec::new();
    for face in faces.take(MOST) {
        let corner = |k: usize| vertices.get(face[k]).copied();
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
            return Err("a face has a vertex that there is not".into());
        };
        all.push([a, b, c]);
    }
    Ok(all)
}

/// Three numbers of single precision, in the byte order of these files.
fn single(bytes: &[u8]) -> [f64; 3] {
    let at =
        |k: usize| bytes.get(4 * k..4 * k + 4).and_then(|b| b.try_into().ok()).map_or(f32::NAN, f32::from_le_bytes);
    [0, 1, 2].map(|k| f64::from(at(k)))
}

fn integer(bytes: &[u8], at: usize) -> Option<usize> {
    let four = bytes.get(at..at + 4)?.try_into().ok()?;
    usize::try_from(i32::from_le_bytes(four)).ok()
}

/// A binary STL file.
pub(crate) fn stl(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let wrong = || "the STL file has another size than its header says; perhaps it is one of text".to_string();
    let count = integer(bytes, 80).filter(|n| (1..=MOST).contains(n)).ok_or_else(wrong)?;
    if bytes.len() != 84 + 50 * count {
        return Err(wrong());
    }
    let corner = |face: &[u8], k: usize| single(&face[12 * (k + 1)..]);
    Ok(bytes[84..].chunks_exact(50).map(|face| [0, 1, 2].map(|k| corner(face, k))).collect())
}

/// A file of MuJoCo's own format.
pub(crate) fn msh(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let wrong = || "the MSH file has another size than its header says".to_string();
    let counts = [0, 4, 8, 12].map(|at| integer(bytes, at).filter(|n| *n <= MOST));
    let [Some(vertices), Some(normals), Some(textures), Some(faces)] = counts else { return Err(wrong()) };
    let start = 16 + 12 * vertices + 12 * normals + 8 * textures;
    if bytes.len() != start + 12 * faces {
        return Err(wrong());
    }
    if faces == 0 {
        return Err("a mesh without faces is not read".into());
    }
    let vertices: Vec<[f64; 3]> = bytes[16..16 + 12 * vertices].chunks_exact(12).map(single).collect();
    let index = |face: &[u8], k: usize| integer(face, 4 * k).unwrap_or(usize::MAX);
    corners(&vertices, bytes[start..].chunks_exact(12).map(|face| [0, 1, 2].map(|k| index(face, k))))
}

/// An OBJ file.
#[derive(Default)]
pub(crate) struct Obj {
    pub vertices: Vec<[f64; 3]>,
    /// Each with its line.
    pub faces: Vec<(usize, Vec<usize>)>,
}

/// Reads an OBJ file: what is read, and all that is wrong with it.
pub(crate) fn obj(bytes: &[u8]) -> (Obj, Vec<Problem>) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return (Obj::default(), Problem::whole("the OBJ file is no text"));
    };
    let (mut obj, mut problems) = (Obj::default(), Vec::new());
    for (line, text) in lines(text) {
        let mut words = text.split_whitespace();
        let mut wrong = |message: &str| problems.push(problem(line, text, message));
        match words.next() {
            // A weight or a colour may follow.
            Some("v") => match triple(words) {
                Some(vertex) => obj.vertices.push(vertex),
                None => wrong("`v` needs three finite numbers"),
            },
            Some("f") => {
                let index = |word: &str| {
                    let k: i64 = word.split('/').next()?.parse().ok()?;
                    let count = i64::try_from(obj.vertices.len()).ok()?;
                    usize::try_from(if k < 0 { count.checked_add(k)? } else { k - 1 }).ok()
                };
                match words.map(index).collect() {
                    Some(face) => obj.faces.push((line, face)),
                    None => wrong("`f` needs numbers of vertices"),
                }
            }
            _ => {}
        }
    }
    (obj, problems)
}

fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(k, line)| (k + 1, line))
}

/// At the first word of a line.
fn problem(line: usize, text: &str, message: &str) -> Problem {
    let blanks = text.chars().take_while(|c| c.is_whitespace()).count();
    Problem { line, column: blanks + 1, message: message.into() }
}

/// The first three words as numbers.
fn triple<'t>(mut words: impl Iterator<Item = &'t str>) -> Option<[f64; 3]> {
    let mut next = || words.next()?.parse().ok().filter(|x: &f64| x.is_finite());
    Some([next()?, next()?, next()?])
}

#[cfg(feature = "hulls")]
pub(crate) use self::hulls::points;

/// What hulls need.
#[cfg(feature = "hulls")]
mod hulls {
    use std::path::Path;

    use super::{lines, obj, problem, stl, triple, Problem, MOST};

    /// The points of a mesh, by the name of its file: STL, binary or text, or OBJ.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub(crate) fn points(path: &Path, bytes: &[u8]) -> Result<Vec<[f64; 3]>, Vec<Problem>> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let (points, problems) = match extension.as_deref() {
            Some("stl") => {
                match std::str::from_utf8(bytes).ok().filter(|text| text.trim_start().starts_with("solid")) {
                    Some(text) => text_stl(text),
                    None => (stl(bytes).map_err(Problem::whole)?.into_flattened(), Vec::new()),
                }
            }
            Some("obj") => {
                let (obj, mut problems) = obj(bytes);
                let missing = |(_, face): &&(usize, Vec<usize>)| face.iter().any(|k| *k >= obj.vertices.len());
                let lost = obj.faces.iter().filter(missing);
                let lost = lost.map(|(line, _)| Problem { line: *line, column: 1, message: LOST.into() });
                problems.extend(lost);
                problems.sort_by_key(|problem| problem.line);
                (obj.vertices, problems)
            }
            _ => return Err(Problem::whole("meshes are read from STL and OBJ files")),
        };
        if !problems.is_empty() {
            return Err(problems);
        }
        let odd = |p: &&[f64; 3]| !p.iter().all(|x| x.is_finite());
        match (points.len(), points.iter().filter(odd).count()) {
            (0, _) => Err(Problem::whole("the mesh has no points")),
            (n, _) if n > 3 * MOST => {
                Err(Problem::whole(format!("the mesh has {n} points; at most {} are read", 3 * MOST)))
            }
            (_, 0) => Ok(points),
            (n, odd) => Err(Problem::whole(format!("{odd} of the {n} points of the mesh are not finite"))),
        }
    }

    const LOST: &str = "a face has a vertex that there is not";

    /// The corners of the triangles of an STL file of text.
    fn text_stl(text: &str) -> (Vec<[f64; 3]>, Vec<Problem>) {
        let (mut points, mut problems, mut corners, mut last) = (Vec::new(), Vec::new(), 0, (1, "", String::new()));
        for (line, text) in lines(text).filter(|(_, text)| !text.trim().is_empty()) {
            let mut words = text.split_whitespace();
            let word = words.next().unwrap_or("").to_ascii_lowercase();
            let mut wrong = |message: &str| problems.push(problem(line, text, message));
            match word.as_str() {
                "vertex" => {
                    corners += 1;
                    match triple(words) {
                        Some(point) => points.push(point),
                        None => wrong("`vertex` needs three finite numbers"),
                    }
                }
                "endfacet" if corners != 3 => wrong("a facet needs three vertices"),
                "endfacet" | "solid" | "facet" | "outer" | "endloop" | "endsolid" => {}
                _ => wrong("this is no line of an STL file"),
            }
            if word == "endfacet" {
                corners = 0;
            }
            last = (line, text, word);
        }
        if last.2 != "endsolid" {
            problems.push(problem(last.0, last.1, "the file ends before `endsolid`"));
        }
        (points, problems)
    }
}

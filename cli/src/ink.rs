//! Colours, dashes and letters of all drawings, the one source of them.
//!
//! A drawing names classes, and the style at its head gives them colours: one set on light paper, another where the
//! reader prefers a dark screen. Tests hold every colour to a contrast of 3 : 1 with its paper, letters to 7 : 1, and all
//! pairs of colours to a distance that protanopes and deuteranopes see too.

use std::fmt::Write as _;

/// Number of colours.
pub const COLOURS: usize = 8;
/// Number of patterns of dashes; the first is a solid line.
pub const DASHES: usize = 4;

/// Colours of one kind of paper, as `#rrggbb`.
pub struct Inks {
    /// Lines and bodies, in the order in which they are used.
    pub lines: [&'static str; COLOURS],
    /// Background.
    pub paper: &'static str,
    /// Letters and axes.
    pub text: &'static str,
    /// Letters of less weight, scales, fixed supports.
    pub muted: &'static str,
    /// Lines of a grid.
    grid: &'static str,
    /// Floors, walls and bases.
    floor: &'static str,
    /// Forces.
    pub force: &'static str,
    /// Part of a body's colour in what fills its outline.
    tint: f64,
}

/// Colours on light paper.
pub const LIGHT: Inks = Inks {
    lines: ["#244ed1", "#c88400", "#4f9a94", "#843d78", "#0790f9", "#7f0005", "#8f5c00", "#262055"],
    paper: "#ffffff",
    text: "#1f2328",
    muted: "#57606a",
    grid: "#e4e7eb",
    floor: "#f0f0ec",
    force: "#d55e00",
    tint: 0.24,
};

/// Colours on dark paper.
pub const DARK: Inks = Inks {
    lines: ["#2e86d6", "#d58500", "#23b594", "#c1a3ff", "#ccd3dd", "#b54d51", "#e2f366", "#ffffee"],
    paper: "#0d1117",
    text: "#e6edf3",
    muted: "#9aa4af",
    grid: "#262c36",
    floor: "#1a2029",
    force: "#ff8a3d",
    tint: 0.36,
};

/// Dashes and gaps of the patterns after the solid line, pixels.
const PATTERNS: [&str; DASHES - 1] = ["7 5", "2 4", "10 4 2 4"];

/// The channels of a colour `#rrggbb`, from 0 to 255.
pub fn channels(colour: &str) -> [f64; 3] {
    [1, 3, 5].map(|k| colour.get(k..k + 2).and_then(|x| u8::from_str_radix(x, 16).ok()).map_or(0.0, f64::from))
}

/// A colour of which `part` is the first and the rest the second.
fn mixed(first: &str, second: &str, part: f64) -> String {
    let (a, b) = (channels(first), channels(second));
    let [r, g, b] = [0, 1, 2].map(|k| (part * a[k] + (1.0 - part) * b[k]).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The rules of one kind of paper.
fn rules(inks: &Inks) -> String {
    let Inks { lines, paper, text, muted, grid, floor, force, tint } = inks;
    let mut css = format!(
        "text{{fill:{text}}}.m{{fill:{muted}}}.paper{{fill:{paper}}}.halo{{stroke:{paper};fill:{paper}}}.grid{{stroke:{grid}}}\
         .axis{{stroke:{muted}}}.floor{{fill:{floor};stroke:{muted}}}.pin{{fill:{paper};stroke:{text}}}\
         .force{{stroke:{force};fill:{force}}}.ink{{stroke:{text};fill:{text}}}.fixed{{stroke:{muted};fill:{grid}}}.plate{{stroke:{grid};fill:{grid}}}"
    );
    for (k, line) in lines.iter().enumerate() {
        let tinted = mixed(line, paper, *tint);
        let _ = write!(css, ".b{k}{{fill:{tinted};stroke:{tinted}}}.c{k}{{stroke:{line}}}.k{k}{{fill:{line}}}");
    }
    css
}

/// The style of a drawing: letters, dashes, and colours for light and dark.
pub fn style() -> String {
    let mut css = String::from(
        "text{font:12px system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',Helvetica,Arial,sans-serif}\
         .small{font-size:11px}.head{font-weight:600}.end{text-anchor:end}.mid{text-anchor:middle}\
         .curve{stroke-width:1.6;stroke-linejoin:round;stroke-linecap:butt}\
         .grid,.axis,.floor{stroke-width:1}.glass{fill-opacity:.72}.round{stroke-linecap:round;stroke-linejoin:round}",
    );
    for (k, dashes) in PATTERNS.iter().enumerate() {
        let _ = write!(css, ".d{}{{stroke-dasharray:{dashes}}}", k + 1);
    }
    // Lines have no fill, whatever their colour says of it.
    let last = ".n,.curve,.grid,.axis{fill:none}";
    format!("<style>{css}{}@media(prefers-color-scheme:dark){{{}}}{last}</style>\n", rules(&LIGHT), rules(&DARK))
}

/// The beginning of a drawing with the name that a reader of screens speaks.
pub fn head(size: [f64; 2], name: &str) -> String {
    let ([width, height], name) = (size, escaped(name));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\" \
         role=\"img\">\n<title>{name}</title>\n{}<rect width=\"100%\" height=\"100%\" class=\"paper\"/>\n",
        style()
    )
}

/// The colours of both kinds of paper, as JSON for the page.
pub fn json() -> String {
    let of = |inks: &Inks| {
        let Inks { lines, paper, text, muted, grid, floor, force, .. } = inks;
        format!(
            "{{\"lines\":{lines:?},\"paper\":{paper:?},\"text\":{text:?},\"muted\":{muted:?},\"grid\":{grid:?},\"floor\":{floor:?},\"force\":{force:?}}}"
        )
    };
    format!("{{\"light\":{},\"dark\":{}}}", of(&LIGHT), of(&DARK))
}

/// The class of a line that is the `k`-th of a chart: colours first, then dashes.
pub fn line_class(k: usize, dash: usize) -> String {
    let dash = (k / COLOURS + dash) % DASHES;
    let colour = k % COLOURS;
    if dash == 0 {
        format!("c{colour}")
    } else {
        format!("c{colour} d{dash}")
    }
}

/// Text with what XML reserves replaced, and control characters, which it does not know, too.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push('?'),
            c => out.push(c),
        }
    }
    out
}

/// Width of a text, pixels: an upper estimate for the usual fonts without serifs, because the reader's font is not known.
pub fn width(text: &str, size: f64) -> f64 {
    let letter = |c: char| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | '·' | ' ' => 0.32,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' => 0.42,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.98,
        'A'..='Z' => 0.72,
        c if !c.is_ascii() && c > '\u{2e80}' => 1.0,
        _ => 0.63,
    };
    size * text.chars().map(letter).sum::<f64>()
}

/// A text shortened to a width: the middle is left out, because the end is more informative.
pub fn shortened(text: &str, size: f64, room: f64) -> String {
    if width(text, size) <= room {
        return text.to_string();
    }
    let letters: Vec<char> = text.chars().collect();
    let cut = |n: usize| -> String {
        let (head, tail) = (n / 2, n - n / 2);
        letters[..head].iter().chain(&['…']).chain(&letters[letters.len() - tail..]).collect()
    };
    (1..letters.len()).rev().map(cut).find(|short| width(short, size) <= room).unwrap_or_else(|| "…".to_string())
}

/// Steps of marks: the numbers 1, 2 or 5 times a power of ten; the smallest that is at least `x`.
pub fn nice(x: f64) -> f64 {
    let decade = 10.0_f64.powf(x.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * decade).find(|s| *s >= x * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}

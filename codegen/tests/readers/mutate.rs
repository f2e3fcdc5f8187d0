//! A small deterministic mutator of text files. It changes bytes, tokens and lines. The tests and the fuzzer in
//! `examples/fuzz.rs` share it.

use std::path::Path;

/// Pseudo-random changes; the same seed gives the same changes.
pub struct Mutator(u64);

/// Pieces of all formats that are inserted anywhere.
const TOKENS: &[&str] = &[
    "[[body]]",
    "[[joint]]",
    "[params]",
    "name = \"a\"",
    "mass = ",
    "{ param = \"x\" }",
    "{ deg = 90 }",
    "[0, 0, 0]",
    "nan",
    "-inf",
    "1e308",
    "-1e-308",
    "1e999",
    "0",
    "-0.0",
    "-1",
    "\"\"",
    "\"ground\"",
    "type = \"floating\"",
    "type = \"universal\"",
    "mimic = { joint = \"a\" }",
    "[[variant]]",
    "[[variant.joint]]",
    "cut = [\"a\"]",
    "lock = [\"a\"]",
    "\n",
    "#",
    "=",
    "[",
    "]",
    "{",
    "}",
    "'''",
    "\"\"\"",
    ",",
    ".",
    "é",
    "\u{0}",
    "\u{feff}",
    "手",
    "0x7fffffffffffffffffffffffffffffffffff",
    "<link name=\"a\"/>",
    "<joint name=\"j\" type=\"revolute\">",
    "</joint>",
    "<mimic joint=\"j\"/>",
    "<inertial>",
    "</robot>",
    "<robot>",
    "<",
    ">",
    "/>",
    "&amp;",
    "&#0;",
    "<!--",
    "-->",
    "<axis xyz=\"0 0 0\"/>",
    "type=\"fixed\"",
    "type=\"floating\"",
    "<![CDATA[",
    "<body name=\"a\">",
    "</body>",
    "<geom size=\"0.1\"/>",
    "<geom type=\"mesh\"/>",
    "<freejoint/>",
    "<joint type=\"ball\"/>",
    "<default class=\"a\">",
    "class=\"a\"",
    "<include file=\"a\"/>",
    "<frame euler=\"1 2 3\">",
    "<weld body1=\"a\"/>",
    "<worldbody>",
    "</mujoco>",
    "<!DOCTYPE a [<!ENTITY b \"b\">]>",
    "&b;",
];

impl Mutator {
    /// A mutator with the given seed.
    pub fn new(seed: u64) -> Self {
        Mutator(seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// A number below `n`.
    fn below(&mut self, n: usize) -> usize {
        // splitmix64
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }

    /// One of the texts in `seeds` with one to eight changes.
    pub fn mutate(&mut self, seeds: &[String]) -> String {
        let mut text = seeds[self.below(seeds.len())].clone();
        for _ in 0..=self.below(3) + self.below(6) / 5 * 5 {
            text = self.change(text, seeds);
        }
        text
    }

    fn change(&mut self, text: String, seeds: &[String]) -> String {
        match self.below(8) {
            0 => self.change_byte(text),
            1 | 2 => self.swap_tokens(&text, seeds),
            3 => self.change_number(&text),
            4 => self.change_lines(&text, seeds),
            5 => {
                let at = boundary(&text, self.below(text.len() + 1));
                let token = TOKENS[self.below(TOKENS.len())];
                format!("{}{token}{}", &text[..at], &text[at..])
            }
            6 => {
                let (a, b) = (self.below(text.len() + 1), self.below(20));
                let (a, b) = (boundary(&text, a), boundary(&text, a + b));
                format!("{}{}", &text[..a], &text[b..])
            }
            _ => self.swap_tokens(&text, seeds),
        }
    }

    fn change_byte(&mut self, text: String) -> String {
        let mut bytes = text.into_bytes();
        if !bytes.is_empty() {
            let at = self.below(bytes.len());
            bytes[at] = self.below(256) as u8;
        }
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Replaces one token by another of any text, such as a name by another name or a type by another type.
    fn swap_tokens(&mut self, text: &str, seeds: &[String]) -> String {
        let source = if self.below(4) == 0 { &seeds[self.below(seeds.len())] } else { text };
        let (from, to) = (tokens(source), tokens(text));
        if from.is_empty() || to.is_empty() {
            return text.to_string();
        }
        let (word, at) = (&source[from[self.below(from.len())].clone()], to[self.below(to.len())].clone());
        format!("{}{word}{}", &text[..at.start], &text[at.end..])
    }

    fn change_number(&mut self, text: &str) -> String {
        const NUMBERS: &[&str] =
            &["0", "-1", "1", "1e-300", "1e300", "-1e300", "1e-12", "90", "1000", "0.1", "nan", "1e5", "-0.001", "2"];
        let all: Vec<_> =
            tokens(text).into_iter().filter(|t| text[t.clone()].starts_with(|c: char| c.is_ascii_digit())).collect();
        if all.is_empty() {
            return text.to_string();
        }
        let at = all[self.below(all.len())].clone();
        format!("{}{}{}", &text[..at.start], NUMBERS[self.below(NUMBERS.len())], &text[at.end..])
    }

    /// Removes, repeats or moves one or a few lines, or inserts lines of another text.
    fn change_lines(&mut self, text: &str, seeds: &[String]) -> String {
        let mut lines: Vec<&str> = text.split('\n').collect();
        let (at, count) = (self.below(lines.len()), 1 + self.below(8));
        let end = (at + count).min(lines.len());
        let piece: Vec<&str> = lines[at..end].to_vec();
        let to = self.below(lines.len());
        match self.below(4) {
            0 => drop(lines.drain(at..end)),
            1 => drop(lines.splice(to..to, piece)),
            2 => {
                lines.drain(at..end);
                let to = to.min(lines.len());
                lines.splice(to..to, piece);
            }
            _ => {
                let other: Vec<&str> = seeds[self.below(seeds.len())].split('\n').collect();
                let from = self.below(other.len());
                lines.splice(to..to, other[from..(from + count).min(other.len())].iter().copied());
            }
        }
        lines.join("\n")
    }
}

/// The nearest character boundary at or before `at`.
fn boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Ranges of the words, numbers and signs of a text.
fn tokens(text: &str) -> Vec<std::ops::Range<usize>> {
    let class = |c: char| match c {
        c if c.is_alphanumeric() || "_.-".contains(c) => 1,
        c if c.is_whitespace() => 0,
        _ => 2,
    };
    let mut out: Vec<std::ops::Range<usize>> = Vec::new();
    let mut before = 0;
    for (k, c) in text.char_indices() {
        let (now, end) = (class(c), k + c.len_utf8());
        match out.last_mut() {
            Some(last) if now == 1 && before == 1 => last.end = end,
            _ if now > 0 => out.push(k..end),
            _ => {}
        }
        before = now;
    }
    out
}

/// The texts of all files with this extension in the folders and their subfolders, in a fixed order.
pub fn corpus(folders: &[&str], extension: &str) -> Vec<String> {
    let mut files = Vec::new();
    let mut open: Vec<_> = folders.iter().map(|f| Path::new(f).to_path_buf()).collect();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                files.push(path);
            }
        }
    }
    files.sort();
    files.iter().filter_map(|f| std::fs::read_to_string(f).ok()).collect()
}

/// The seeds, with those that are models repeated until they make up half. Damaged models get furthest through the
/// reader.
pub fn balanced(mut seeds: Vec<String>, is_model: impl Fn(&str) -> bool) -> Vec<String> {
    let good: Vec<String> = seeds.iter().filter(|s| is_model(s)).cloned().collect();
    let missing = seeds.len().saturating_sub(2 * good.len());
    seeds.extend(good.into_iter().cycle().take(missing));
    seeds
}

//! Wording shared by the readers and the checks: quoted names, enumerations, "did you mean".

/// A name from the file in backticks, control characters escaped, shortened if very long.
pub fn quote(name: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = name.chars().take(LONGEST).flat_map(escape).collect();
    if name.chars().nth(LONGEST).is_some() {
        shown.push('…');
    }
    format!("`{shown}`")
}

fn escape(c: char) -> Vec<char> {
    if c.is_control() {
        c.escape_default().collect()
    } else {
        vec![c]
    }
}

/// Most names that a list shows.
pub const SHOWN: usize = 8;

/// `` `a`, `b` and `c` ``, cut off after eight.
pub fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    list_of(&names, names.len())
}

/// The same of `count` names, of which at least the first that are shown are given.
pub fn list_of(names: &[&str], count: usize) -> String {
    let quoted: Vec<String> = names.iter().take(SHOWN).map(|name| quote(name)).collect();
    match quoted.len() {
        0 => "none".into(),
        n if count > n => format!("{} and {} more", quoted.join(", "), count - n),
        1 => quoted[0].clone(),
        n => format!("{} and {}", quoted[..n - 1].join(", "), quoted[n - 1]),
    }
}

/// The candidate closest to `word`, if one is close enough.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 64;
    let word: Vec<char> = word.chars().take(LONGEST + 1).flat_map(char::to_lowercase).collect();
    if word.len() > LONGEST {
        return None;
    }
    let limit = (word.len() / 3).max(1);
    let mut best = None;
    for candidate in candidates {
        let other: Vec<char> = candidate.chars().take(2 * LONGEST).flat_map(char::to_lowercase).collect();
        if other.len().abs_diff(word.len()) > limit {
            continue;
        }
        let d = distance(&word, &other);
        // A word without a common letter is no suggestion, even if it is short.
        let plausible = d <= limit && d < word.len().max(other.len());
        // Swapped letters are more likely than other mistakes.
        let rank = (d, sorted(&word) != sorted(&other));
        if plausible && best.is_none_or(|(b, _)| rank < b) {
            best = Some((rank, candidate));
        }
    }
    best.map(|(_, c)| c)
}

fn sorted(word: &[char]) -> Vec<char> {
    let mut letters = word.to_vec();
    letters.sort_unstable();
    letters
}

/// Help text with the closest candidate; without one, `otherwise`.
pub fn did_you_mean<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
    otherwise: impl FnOnce() -> String,
) -> String {
    match closest(word, candidates) {
        Some(c) => format!("did you mean {}?", quote(c)),
        None => otherwise(),
    }
}

/// Edits (insert, delete, replace, swap of neighbours) from one word to the other.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut row = vec![i + 1; b.len() + 1];
        for j in 0..b.len() {
            row[j + 1] = (last[j] + usize::from(a[i] != b[j])).min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                row[j + 1] = row[j + 1].min(before[j - 1] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions() {
        assert_eq!(closest("upper_am", ["upper_arm", "lower_arm"]), Some("upper_arm"));
        assert_eq!(closest("mas", ["mass", "name"]), Some("mass"));
        assert_eq!(closest("Mass", ["mass"]), Some("mass"));
        assert_eq!(closest("naem", ["name"]), Some("name"));
        assert_eq!(closest("yx", ["xx", "xy"]), Some("xy"));
        assert_eq!(closest("x", ["y"]), None);
        assert_eq!(closest("colour", ["mass", "com", "name"]), None);
        assert_eq!(closest(&"a".repeat(100), ["a"]), None);
        assert_eq!(closest("", ["a", ""]), None);
    }

    #[test]
    fn edits() {
        let d = |a: &str, b: &str| distance(&a.chars().collect::<Vec<_>>(), &b.chars().collect::<Vec<_>>());
        assert_eq!(d("kitten", "sitting"), 3);
        assert_eq!(d("ab", "ba"), 1);
        assert_eq!(d("", "abc"), 3);
        assert_eq!(d("same", "same"), 0);
    }

    #[test]
    fn names_are_shown_safely() {
        assert_eq!(quote("a\nb"), "`a\\nb`");
        assert_eq!(quote(&"x".repeat(70)), format!("`{}…`", "x".repeat(60)));
        assert_eq!(list(["a", "b", "c"]), "`a`, `b` and `c`");
        assert_eq!(list(["a"; 10]), "`a`, `a`, `a`, `a`, `a`, `a`, `a`, `a` and 2 more");
    }
}

//! Rust source as words and bracketed groups.

/// A word, or a group in brackets.
#[derive(Debug)]
pub enum Tree<'a> {
    /// A path without type arguments (`q`, `::mbd_runtime::trig::pair_f64`), a number, a text, or a punctuation mark.
    Word(&'a str),
    /// `( .. )`
    Round(Vec<Tree<'a>>),
    /// `[ .. ]`
    Square(Vec<Tree<'a>>),
    /// `{ .. }`
    Curly(Vec<Tree<'a>>),
}

/// The trees of a source text. Comments are left out.
pub fn trees(source: &str) -> Vec<Tree<'_>> {
    let mut open: Vec<(&str, Vec<Tree>)> = vec![("", Vec::new())];
    let mut rest = source;
    loop {
        rest = rest.trim_ascii_start();
        if rest.starts_with("//") {
            rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
            continue;
        }
        if rest.is_empty() {
            break;
        }
        let (word, after) = rest.split_at(word_length(rest));
        rest = after;
        if matches!(word, "(" | "[" | "{") {
            open.push((word, Vec::new()));
            continue;
        }
        let tree = match word {
            ")" | "]" | "}" => {
                let (bracket, inside) = open.pop().expect("the outermost level is not a group");
                match (bracket, word) {
                    ("(", ")") => Tree::Round(inside),
                    ("[", "]") => Tree::Square(inside),
                    ("{", "}") => Tree::Curly(inside),
                    _ => panic!("{bracket:?} is closed by {word:?}\n{source}"),
                }
            }
            word => Tree::Word(word),
        };
        open.last_mut().expect("more groups are closed than opened").1.push(tree);
    }
    let (bracket, all) = open.pop().expect("the outermost level");
    assert!(open.is_empty(), "{bracket:?} is not closed\n{source}");
    all
}

/// Length of the first word of a text, in bytes.
fn word_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let is = |k: usize, class: fn(&u8) -> bool| bytes.get(k).is_some_and(class);
    let run = |from: usize, class: fn(&u8) -> bool| from + bytes[from..].iter().take_while(|b| class(b)).count();
    let letter = |b: &u8| b.is_ascii_alphabetic() || *b == b'_';
    let inner = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
    match bytes[0] {
        b'0'..=b'9' => {
            let mut end = run(0, u8::is_ascii_digit);
            if is(end, |b| *b == b'.') && is(end + 1, u8::is_ascii_digit) {
                end = run(end + 1, u8::is_ascii_digit);
            }
            if is(end, |b| *b == b'e') {
                let sign = usize::from(is(end + 1, |b| *b == b'-'));
                end = run(end + 1 + sign, u8::is_ascii_digit);
            }
            assert!(!is(end, inner), "a name starts with a digit: {}", text.lines().next().unwrap_or_default());
            end
        }
        b'"' => {
            let mut escaped = false;
            let end = text[1..].find(|c| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            end.expect("a text ends") + 2
        }
        b'.' if text.starts_with("..") => 2,
        b if letter(&b) || text.starts_with("::") => {
            let mut end = 0;
            loop {
                end = run(end, inner);
                match text[end..].strip_prefix("::") {
                    Some(more) if more.as_bytes().first().is_some_and(letter) => end += 2,
                    _ => break end.max(if end == 0 { 2 } else { end }),
                }
            }
        }
        _ => text.chars().next().map_or(0, char::len_utf8),
    }
}

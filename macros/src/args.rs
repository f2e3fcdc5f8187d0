//! Arguments of the macro: `key = value` pairs, each parsed separately, so that all errors are reported at once.

use mbd_codegen::options::{AngleRange, EliminationStrategy, RowElimination};
use mbd_codegen::read::Base;
use mbd_codegen::words::{did_you_mean, list, quote};
use mbd_codegen::{Arithmetic, LikeBranches, Options, Output, Precision, RolledCode};
use proc_macro2::{Delimiter, Ident, Span, TokenStream, TokenTree};

use crate::literal;
use crate::message::{Message, Place};

/// Source of the description.
#[derive(Clone, Debug)]
pub enum Source {
    /// In a file.
    File(String),
    /// In the source: TOML.
    Toml(String),
    /// In the source: URDF.
    Urdf(String),
    /// In the source: MJCF.
    Mjcf(String),
}

/// Name of the type, with attributes and visibility.
#[derive(Clone, Debug)]
pub struct Name {
    /// Attributes.
    pub attributes: TokenStream,
    /// Visibility; empty: `pub`.
    pub visibility: TokenStream,
    /// The name.
    pub ident: Ident,
}

/// A type of the same description.
#[derive(Clone, Debug)]
pub struct From {
    /// Its variant; `None`: the model itself.
    pub variant: Option<String>,
    /// The type.
    pub ident: Ident,
    /// The whole entry.
    pub place: Place,
}

/// All arguments that could be parsed.
#[derive(Clone, Debug, Default)]
pub struct Args {
    /// The description, and the literal that states it.
    pub source: Option<(Source, Place)>,
    /// The type.
    pub name: Option<Name>,
    /// The variant of the description.
    pub variant: Option<(String, Place)>,
    /// Types from which states are carried over, with the variants that they were made from.
    pub from: Vec<From>,
    /// How the root is attached.
    pub base: Option<(Base, Place)>,
    /// Gravity instead of the model's.
    pub gravity: Option<[f64; 3]>,
    /// Frames by name.
    pub frames: Vec<(String, Place)>,
    /// Modes of contacts for which code is made.
    pub modes: Option<(Modes, Place)>,
    /// Options that are passed to the generator unchanged.
    pub options: Options,
    /// Path of the runtime crate.
    pub runtime: Option<TokenStream>,
}

/// Modes of contacts for which code is made.
#[derive(Clone, Debug)]
pub enum Modes {
    /// In one set of functions.
    Masked,
    /// All sets of modes.
    All,
    /// In pieces that serve all sets of modes.
    Factored,
    /// Sets of modes in a file.
    Recorded(String),
    /// Sets of modes as text: one on each line.
    Listed(String),
}

const KEYS: [&str; 22] = [
    "path",
    "name",
    "variant",
    "from",
    "outputs",
    "scalar",
    "arithmetic",
    "angles",
    "elimination",
    "rolled",
    "branches",
    "rows",
    "base",
    "gravity",
    "efforts",
    "frames",
    "snap",
    "modes",
    "toml",
    "urdf",
    "mjcf",
    "runtime",
];

const EXAMPLE: &str = "as in `mbd_model! { path = \"models/arm.toml\", name = Arm }`";

/// Splits at commas.
fn segments(tokens: Vec<TokenTree>) -> Vec<Vec<TokenTree>> {
    let comma = |t: &TokenTree| matches!(t, TokenTree::Punct(p) if p.as_char() == ',');
    tokens.split(comma).filter(|s| !s.is_empty()).map(<[TokenTree]>::to_vec).collect()
}

/// Tokens without the invisible groups that a surrounding `macro_rules!` adds to its fragments.
fn visible(tokens: TokenStream) -> Vec<TokenTree> {
    let mut out = Vec::new();
    for token in tokens {
        match token {
            TokenTree::Group(g) if g.delimiter() == Delimiter::None => out.extend(visible(g.stream())),
            other => out.push(other),
        }
    }
    out
}

fn is_punct(token: Option<&TokenTree>, c: char) -> bool {
    matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == c)
}

/// Reads the arguments; what is wrong with them is added to `errors`.
pub fn parse(input: TokenStream, errors: &mut Vec<Message>) -> Args {
    let mut args = Args::default();
    let mut seen: Vec<String> = Vec::new();
    let clean = errors.len();
    for segment in segments(visible(input)) {
        let whole = Place::of(&segment, Span::call_site().into());
        let TokenTree::Ident(key) = &segment[0] else {
            errors.push(Message::new(whole, "expected an argument", format!("write `key = value`, {EXAMPLE}")));
            continue;
        };
        let word = key.to_string();
        let known = KEYS.contains(&word.as_str());
        if !known {
            let help = did_you_mean(&word, KEYS, || format!("the arguments are {}", list_all(KEYS)));
            errors.push(Message::new(key.span(), format!("unknown argument {}", quote(&word)), help));
        } else if seen.contains(&word) && word != "runtime" {
            // The facade states the runtime; a second one overrides it.
            errors.push(Message::new(key.span(), format!("argument `{word}` is given twice"), "keep one of them"));
        } else if !is_punct(segment.get(1), '=') || segment.len() < 3 {
            let help = format!("write `{word} = ...`");
            errors.push(Message::new(whole, format!("argument `{word}` has no value"), help));
        } else if let Err(error) = args.set(key, &segment[2..]) {
            errors.push(error);
        }
        seen.push(word);
    }
    let given = |keys: &[&str]| keys.iter().any(|k| seen.iter().any(|s| s == k));
    // A missing argument may be a misspelt one, for which there is a message already.
    let unnamed = errors.len() > clean;
    if !unnamed && !given(&["path", "toml", "urdf", "mjcf"]) {
        let help = format!("add `path = \"...\"`, {EXAMPLE}, or `toml = \"...\"` with the description itself");
        errors.push(Message::new(Span::call_site(), "no model is given", help));
    }
    if !unnamed && !given(&["name"]) {
        errors.push(Message::new(
            Span::call_site(),
            "argument `name` is missing",
            "add `name = Arm`, the type to make",
        ));
    }
    args
}

fn list_all(names: impl IntoIterator<Item = &'static str>) -> String {
    names.into_iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
}

impl Args {
    fn set(&mut self, key: &Ident, value: &[TokenTree]) -> Result<(), Message> {
        let word = key.to_string();
        match word.as_str() {
            "path" => self.set_source(key, Source::File(text(&word, value)?), value)?,
            "toml" => self.set_source(key, Source::Toml(text(&word, value)?), value)?,
            "urdf" => self.set_source(key, Source::Urdf(text(&word, value)?), value)?,
            "mjcf" => self.set_source(key, Source::Mjcf(text(&word, value)?), value)?,
            "name" => self.name = Some(name(value)?),
            "variant" => self.variant = Some((text(&word, value)?, place(value))),
            "outputs" => self.options.outputs = outputs(value)?,
            "scalar" => {
                self.options.precision = choice("scalar", value, &Precision::ALL.map(|p| (p.name(), p)))?;
            }
            "arithmetic" => {
                self.options.arithmetic = choice("arithmetic", value, &Arithmetic::ALL.map(|a| (a.name(), a)))?;
            }
            "angles" => self.options.angles = choice(&word, value, &AngleRange::ALL.map(|a| (a.name(), a)))?,
            "from" => self.from = from(value)?,
            "elimination" => {
                let choices = EliminationStrategy::ALL.map(|e| (e.name(), e));
                self.options.plan.elimination = choice(&word, value, &choices)?;
            }
            "rolled" => {
                self.options.plan.rolled = choice(&word, value, &RolledCode::ALL.map(|r| (r.name(), r)))?;
            }
            "branches" => {
                self.options.plan.branches = choice(&word, value, &LikeBranches::ALL.map(|b| (b.name(), b)))?;
            }
            "rows" => {
                self.options.plan.rows = choice(&word, value, &RowElimination::ALL.map(|r| (r.name(), r)))?;
            }
            "base" => {
                self.base = Some((choice("base", value, &Base::ALL.map(|b| (b.name(), b)))?, place(value)));
            }
            "gravity" => self.gravity = Some(gravity(value)?),
            "efforts" => self.options.efforts = choice("efforts", value, &[("true", true), ("false", false)])?,
            "frames" => self.frames = frames(value)?,
            "modes" => self.modes = Some((modes(value)?, place(value))),
            "snap" => match number(value) {
                Some(x) if x >= 0.0 => self.options.plan.snap = x,
                _ => {
                    return Err(Message::new(
                        place(value),
                        "`snap` has to be an angle in rad, 0 or more",
                        "the default is 1e-6",
                    ))
                }
            },
            _ => self.runtime = Some(value.iter().cloned().collect()),
        }
        Ok(())
    }

    fn set_source(&mut self, key: &Ident, source: Source, value: &[TokenTree]) -> Result<(), Message> {
        if self.source.is_some() {
            let message = format!("a second model: `{key}`");
            return Err(Message::new(key.span(), message, "give one of `path`, `toml`, `urdf` and `mjcf`"));
        }
        self.source = Some((source, place(value)));
        Ok(())
    }
}

/// Of a value, which has a token at least.
fn place(value: &[TokenTree]) -> Place {
    Place::of(value, Span::call_site().into())
}

fn text(key: &str, value: &[TokenTree]) -> Result<String, Message> {
    let literal = match value {
        [TokenTree::Literal(l)] => literal::string(&l.to_string()),
        _ => None,
    };
    literal.ok_or_else(|| {
        let help = match key {
            "path" => {
                "write the path itself, relative to the folder of Cargo.toml: `path = \"models/arm.toml\"`".to_string()
            }
            "variant" => "write the name of a `[[variant]]` of the description: `variant = \"docked\"`".to_string(),
            _ => format!("write the description itself, `{key} = r#\"...\"#`, or name its file with `path`"),
        };
        Message::new(place(value), format!("`{key}` has to be a string literal"), help)
    })
}

fn name(value: &[TokenTree]) -> Result<Name, Message> {
    let mut rest = value;
    let mut attributes = TokenStream::new();
    while let [TokenTree::Punct(p), TokenTree::Group(g), ..] = rest {
        if p.as_char() != '#' || g.delimiter() != Delimiter::Bracket {
            break;
        }
        attributes.extend(rest[..2].iter().cloned());
        rest = &rest[2..];
    }
    let mut visibility = 0;
    if matches!(rest.first(), Some(TokenTree::Ident(i)) if *i == "pub") {
        visibility = 1;
        if matches!(rest.get(1), Some(TokenTree::Group(g)) if g.delimiter() == Delimiter::Parenthesis) {
            visibility = 2;
        }
    }
    match &rest[visibility..] {
        [TokenTree::Ident(ident)] => {
            Ok(Name { attributes, visibility: rest[..visibility].iter().cloned().collect(), ident: ident.clone() })
        }
        _ => Err(Message::new(
            place(value),
            "`name` has to be the name of a type",
            "write a name, with attributes and visibility where wanted: `name = Arm` or `name = pub(crate) Arm`",
        )),
    }
}

/// `Type`, or a list of types, each of a variant: `[Type, "variant": Type]`.
fn from(value: &[TokenTree]) -> Result<Vec<From>, Message> {
    let list = match value {
        [TokenTree::Ident(_)] => vec![value.to_vec()],
        _ => elements("from", value, "[Whole, \"held\": Held]")?,
    };
    let one = |entry: Vec<TokenTree>| {
        let place = place(&entry);
        let help = "write the type, and before it the variant that it was made from: `from = [Whole, \"held\": Held]`";
        let refuse = || Message::new(place, "`from` has to name types of this description", help);
        match entry.as_slice() {
            [TokenTree::Ident(ident)] => Ok(From { variant: None, ident: ident.clone(), place }),
            [TokenTree::Literal(variant), colon, TokenTree::Ident(ident)] if is_punct(Some(colon), ':') => {
                let variant = literal::string(&variant.to_string()).ok_or_else(refuse)?;
                Ok(From { variant: Some(variant), ident: ident.clone(), place })
            }
            _ => Err(refuse()),
        }
    };
    list.into_iter().map(one).collect()
}

fn choice<T: Copy>(key: &str, value: &[TokenTree], choices: &[(&'static str, T)]) -> Result<T, Message> {
    let written: String = value.iter().map(|t| t.to_string()).collect();
    if let Some((_, chosen)) = choices.iter().find(|(name, _)| *name == written) {
        return Ok(*chosen);
    }
    let names = || choices.iter().map(|(name, _)| *name);
    let help = did_you_mean(&written, names(), || format!("choose one of {}", list(names())));
    Err(Message::new(place(value), format!("`{key}` cannot be {}", quote(&written)), help))
}

/// Elements of `[a, b, c]`, each with a token at least.
fn elements(key: &str, value: &[TokenTree], example: &str) -> Result<Vec<Vec<TokenTree>>, Message> {
    match value {
        [TokenTree::Group(g)] if g.delimiter() == Delimiter::Bracket => Ok(segments(visible(g.stream()))),
        _ => {
            let help = format!("write `{key} = {example}`");
            Err(Message::new(place(value), format!("`{key}` has to be a list in brackets"), help))
        }
    }
}

fn outputs(value: &[TokenTree]) -> Result<Vec<Output>, Message> {
    let mut chosen = Vec::new();
    for element in elements("outputs", value, "[rates, energy]")? {
        let written: String = element.iter().map(|t| t.to_string()).collect();
        let names = || Output::ALL.iter().map(|output| output.name());
        let Some(group) = Output::from_name(&written) else {
            let help = did_you_mean(&written, names(), || format!("the outputs are {}", list_all(names())));
            return Err(Message::new(place(&element), format!("unknown output {}", quote(&written)), help));
        };
        if chosen.contains(&group) {
            return Err(Message::new(
                place(&element),
                format!("output `{written}` is listed twice"),
                "keep one of them",
            ));
        }
        chosen.push(group);
    }
    Ok(chosen)
}

fn frames(value: &[TokenTree]) -> Result<Vec<(String, Place)>, Message> {
    let mut chosen: Vec<(String, Place)> = Vec::new();
    for element in elements("frames", value, "[tool0, \"left-foot\"]")? {
        let name = match element.as_slice() {
            [TokenTree::Ident(i)] => Some(i.to_string()),
            [TokenTree::Literal(l)] => literal::string(&l.to_string()),
            _ => None,
        };
        let Some(name) = name else {
            let help = "write a plain name, or a string where it is no identifier: `frames = [tool0, \"left-foot\"]`";
            return Err(Message::new(place(&element), "expected the name of a frame or body", help));
        };
        if chosen.iter().any(|(n, _)| *n == name) {
            let message = format!("frame {} is listed twice", quote(&name));
            return Err(Message::new(place(&element), message, "keep one of them"));
        }
        chosen.push((name, place(&element)));
    }
    Ok(chosen)
}

/// `masked`, `all`, `factored`, `recorded("file")` or `["open", "stick"]`.
fn modes(value: &[TokenTree]) -> Result<Modes, Message> {
    let help =
        "write `modes = masked`, `modes = all`, `modes = factored`, `modes = recorded(\"robot.modes\")` with a file that `mbd simulate \
                --record-modes` writes, or `modes = [\"open open\", \"stick open\"]` with a word for each contact";
    let wrong = || Message::new(place(value), "`modes` cannot be read", help);
    match value {
        [TokenTree::Ident(word)] if *word == "masked" => Ok(Modes::Masked),
        [TokenTree::Ident(word)] if *word == "all" => Ok(Modes::All),
        [TokenTree::Ident(word)] if *word == "factored" => Ok(Modes::Factored),
        [TokenTree::Ident(word), TokenTree::Group(g)] if *word == "recorded" => {
            let tokens = visible(g.stream());
            let path = match tokens.as_slice() {
                [TokenTree::Literal(l)] => literal::string(&l.to_string()),
                _ => None,
            };
            path.map(Modes::Recorded).ok_or_else(wrong)
        }
        [TokenTree::Group(g)] if g.delimiter() == Delimiter::Bracket => {
            let line = |element: &Vec<TokenTree>| match element.as_slice() {
                [TokenTree::Literal(l)] => literal::string(&l.to_string()),
                _ => None,
            };
            let lines: Option<Vec<String>> = segments(visible(g.stream())).iter().map(line).collect();
            lines.map(|lines| Modes::Listed(lines.join("\n"))).ok_or_else(wrong)
        }
        _ => Err(wrong()),
    }
}

fn number(value: &[TokenTree]) -> Option<f64> {
    let (sign, literal) = match value {
        [TokenTree::Literal(l)] => (1.0, l),
        [minus, TokenTree::Literal(l)] if is_punct(Some(minus), '-') => (-1.0, l),
        _ => return None,
    };
    literal::number(&literal.to_string()).map(|x| sign * x).filter(|x| x.is_finite())
}

fn gravity(value: &[TokenTree]) -> Result<[f64; 3], Message> {
    let help = "write `gravity = [0.0, 0.0, -9.81]`: three numbers in m/s², in ground axes";
    let parts = elements("gravity", value, "[0.0, 0.0, -9.81]")?;
    let [x, y, z] = parts.as_slice() else {
        return Err(Message::new(place(value), format!("`gravity` has {} numbers instead of 3", parts.len()), help));
    };
    let mut g = [0.0; 3];
    for (to, from) in g.iter_mut().zip([x, y, z]) {
        *to = number(from).ok_or_else(|| Message::new(place(from), "expected a number", help))?;
    }
    Ok(g)
}

#[cfg(test)]
mod tests {
    use super::KEYS;

    #[test]
    fn the_book_has_every_argument() {
        let page = include_str!("../../book/src/macro.md");
        let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| `")).collect();
        for key in KEYS {
            let stated = format!("`{key} = ");
            assert!(rows.iter().any(|row| row.contains(&stated)), "book/src/macro.md has no row for `{key}`");
        }
    }
}

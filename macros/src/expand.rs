//! Expansion of the macro.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use mbd_codegen::diag::{Diagnostic, Severity};
use mbd_codegen::model::Model;
use mbd_codegen::modes::{parse, ModeChoice};
use mbd_codegen::read::{chosen, load_with, read_bytes, Base, ImportOptions, Variant};
use mbd_codegen::words::{closest, did_you_mean, list, quote};
use mbd_codegen::{generate, transfer_code};
use proc_macro2::{Group as Tokens, Ident, Literal, Span, TokenStream, TokenTree};

use crate::args::{self, Args, From, Modes, Name, Source};
use crate::message::{Message, Place};
use crate::stub;

/// Placeholder for the path of the runtime, until the text has been parsed into tokens: a path like `$crate::runtime`
/// cannot be written as text.
const RUNTIME: &str = "__mbd_runtime";

/// The expansion of `mbd_model! { input }`.
pub fn expand(input: TokenStream) -> TokenStream {
    let mut errors = Vec::new();
    let mut args = args::parse(input, &mut errors);
    let text = args.source.clone().and_then(|(source, place)| read(&source, place, &mut errors));
    let mut watched = TokenStream::new();
    let (mut model, mut all) = (None, None);
    if let Some(text) = &text {
        let Loaded { read, findings, files } = text.load(&args);
        watched.extend(files.iter().map(|file| tracked(file)));
        all = read.clone();
        model = read.and_then(|(model, variants)| {
            let (name, place) = args.variant.as_ref().map_or((None, text.place), |(name, place)| (Some(name), *place));
            let chosen = chosen(model, variants, name.map(String::as_str));
            chosen.map_err(|(message, help)| errors.push(Message::new(place, message, help))).ok()
        });
        judge(text, &findings, model.as_ref(), &mut args, &mut errors);
        if let (Some((modes, place)), Some(model)) = (args.modes.clone(), model.as_ref()) {
            let (choice, file) = modes_of(&modes, place, model, &mut errors);
            args.options.modes = choice;
            watched.extend(file.as_deref().map(tracked));
        }
        watched.extend(text.tracked());
        watched.extend(text.warnings(&findings));
    }
    let mut out: TokenStream = errors.iter().map(Message::compile_error).collect();
    out.extend(watched);
    let Some(name) = &args.name else { return out };
    args.options.type_name = name.ident.to_string();
    args.options.runtime = RUNTIME.to_string();
    let generated = model.and_then(|m| match generate(&m, &args.options) {
        Ok(generated) => {
            let (carried, errors) = carried(&m, &args, all.as_ref());
            out.extend(errors.iter().map(Message::compile_error));
            Some(generated.source + &carried)
        }
        Err(error) => {
            let place = text.as_ref().map_or(Span::call_site().into(), |t| t.place);
            out.extend(Message::new(place, error.to_string(), "").compile_error());
            None
        }
    });
    let source = generated.unwrap_or_else(|| stub::source(&args.options));
    match source.parse::<TokenStream>() {
        Ok(tokens) => out.extend(finish(tokens, name, args.runtime.as_ref())),
        Err(error) => {
            let help = "this is a mistake in the generator; please report it with the model";
            let message = format!("the generated code is no Rust: {error}");
            out.extend(Message::new(Span::call_site(), message, help).compile_error());
        }
    }
    out
}

/// Code that carries states over from other types of the same description, and what is wrong with them.
fn carried(model: &Model, args: &Args, all: Option<&(Model, Vec<Variant>)>) -> (String, Vec<Message>) {
    let (mut code, mut errors) = (String::new(), Vec::new());
    for From { variant, ident, place } in &args.from {
        let Some((base, variants)) = all.cloned() else { continue };
        let made = chosen(base, variants, variant.as_deref()).and_then(|from| {
            let help = "leave the type out of `from`, or change the variant".to_string();
            transfer_code(&from, &ident.to_string(), model, &args.options).map_err(|e| (e.to_string(), help))
        });
        match made {
            Ok(text) => code += &text,
            Err((message, help)) => errors.push(Message::new(*place, message, help)),
        }
    }
    (code, errors)
}

/// A description and its source.
struct Text {
    /// Its name in findings; the extension is the format.
    label: String,
    /// The description.
    text: String,
    /// The file to watch.
    file: Option<PathBuf>,
    /// Literal that states the path or the description.
    place: Place,
}

/// Text of the description; a file that cannot be read is an error.
fn read(source: &Source, place: Place, errors: &mut Vec<Message>) -> Option<Text> {
    let path = match source {
        Source::File(path) => path,
        Source::Toml(text) => return Some(Text { label: "inline.toml".into(), text: text.clone(), file: None, place }),
        Source::Urdf(text) => return Some(Text { label: "inline.urdf".into(), text: text.clone(), file: None, place }),
        Source::Mjcf(text) => return Some(Text { label: "inline.mjcf".into(), text: text.clone(), file: None, place }),
    };
    let root = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default();
    let file = root.join(path);
    match std::fs::read_to_string(&file) {
        Ok(text) => Some(Text { label: path.clone(), text, file: Some(file), place }),
        Err(error) => {
            let (message, help) = match error.kind() {
                std::io::ErrorKind::NotFound => {
                    (format!("there is no file {}", quote(path)), similar_file(&file, path))
                }
                std::io::ErrorKind::InvalidData => {
                    (format!("{} is not UTF-8 text", quote(path)), "models are TOML, URDF or MJCF text".to_string())
                }
                _ => (format!("cannot read {}: {error}", quote(path)), "a path names the file of a model".to_string()),
            };
            errors.push(Message::new(place, message, help));
            None
        }
    }
}

fn similar_file(file: &Path, path: &str) -> String {
    let folder = file.parent().and_then(|f| std::fs::read_dir(f).ok());
    let names = folder.into_iter().flatten().flatten().map(|e| e.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.collect();
    names.sort();
    let wanted = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    match closest(&wanted, names.iter().map(String::as_str)) {
        Some(name) => {
            format!("did you mean {}?", quote(&format!("{}{name}", path.strip_suffix(&wanted).unwrap_or(""))))
        }
        None => "paths are relative to the folder of Cargo.toml".to_string(),
    }
}

/// What is read from a description.
struct Loaded {
    /// The model and its variants, if there is no error.
    read: Option<(Model, Vec<Variant>)>,
    findings: Vec<Diagnostic>,
    /// The files that the description names, as its base or to include them.
    files: Vec<PathBuf>,
}

impl Text {
    fn is_toml(&self) -> bool {
        Path::new(&self.label).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    }

    /// One finding as it is shown to the user.
    fn shown(&self, d: &Diagnostic) -> (String, String) {
        let at = match (&self.file, d.line) {
            (Some(_), 0) => format!("{}: ", d.file),
            (Some(_), line) => format!("{}:{line}:{}: ", d.file, d.column),
            (None, 0) => String::new(),
            (None, line) => format!("line {line}, column {} of the text: ", d.column),
        };
        (format!("{at}{}", d.message), d.help.clone())
    }

    /// Reads the description.
    fn load(&self, args: &Args) -> Loaded {
        let named = RefCell::new(Vec::new());
        let files = |path: &Path| {
            let root = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default();
            let file = root.join(path);
            let bytes = read_bytes(&file)?;
            named.borrow_mut().push(file);
            Ok(bytes)
        };
        let base = args.base.map_or(Base::default(), |(base, _)| base);
        // This is reported at the argument itself.
        let base = if self.is_toml() { Base::default() } else { base };
        let options = ImportOptions { base, gravity: args.gravity, ..ImportOptions::default() };
        let (read, findings) = load_with(&self.label, &self.text, &options, &files);
        Loaded { read, findings: findings.0, files: named.take() }
    }

    /// Makes the compiler read the file again when it changes.
    fn tracked(&self) -> TokenStream {
        self.file.as_deref().map(tracked).unwrap_or_default()
    }

    /// A macro cannot issue warnings; the use of a deprecated item is a warning with a text.
    fn warnings(&self, findings: &[Diagnostic]) -> TokenStream {
        let mut out = TokenStream::new();
        for d in findings.iter().filter(|d| d.severity == Severity::Warning) {
            let (message, help) = self.shown(d);
            let note = Literal::string(&format!("{message}\nhelp: {help}"));
            let item = format!(
                "const _: () = {{ #[deprecated(note = {note})] const MODEL_WARNING: () = (); MODEL_WARNING }};"
            );
            let tokens = item.parse().unwrap_or_default();
            out.extend(replace(tokens, &mut |token| match token {
                TokenTree::Ident(i) if *i == "MODEL_WARNING" => {
                    Some(TokenTree::from(Ident::new("MODEL_WARNING", self.place.0)).into())
                }
                _ => None,
            }));
        }
        out
    }
}

/// Makes the compiler read a file again when it changes.
fn tracked(file: &Path) -> TokenStream {
    let path = file.to_str().map(|p| Literal::string(p).to_string());
    let text = path.map(|p| format!("const _: &[u8] = ::core::include_bytes!({p});"));
    text.and_then(|t| t.parse().ok()).unwrap_or_default()
}

/// The modes of contacts that an argument asks for, and the file that states them.
fn modes_of(
    modes: &Modes,
    place: Place,
    model: &Model,
    errors: &mut Vec<Message>,
) -> (Option<ModeChoice>, Option<PathBuf>) {
    let (text, name, file) = match modes {
        Modes::Masked => return (Some(ModeChoice::Masked), None),
        Modes::All => return (Some(ModeChoice::All), None),
        Modes::Factored => return (Some(ModeChoice::Factored), None),
        Modes::Listed(text) => (text.clone(), "set", None),
        Modes::Recorded(path) => {
            let file = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default().join(path);
            match std::fs::read_to_string(&file) {
                Ok(text) => (text, path.as_str(), Some(file)),
                Err(error) => {
                    let message = format!("cannot read {}: {error}", quote(path));
                    errors.push(Message::new(place, message, similar_file(&file, path)));
                    return (None, None);
                }
            }
        }
    };
    match parse(&text, model) {
        Ok(sets) => (Some(ModeChoice::Listed(sets)), file),
        Err(wrong) => {
            for (line, what) in wrong {
                let at = if file.is_some() { format!("{name}:{line}") } else { format!("{name} {line}") };
                let help = "a set has a word for each contact, in the order of the model: `open`, `slide` or `stick`";
                errors.push(Message::new(place, format!("{at}: {what}"), help));
            }
            (None, file)
        }
    }
}

/// Converts findings to errors, and checks the arguments that depend on the model.
fn judge(text: &Text, findings: &[Diagnostic], model: Option<&Model>, args: &mut Args, errors: &mut Vec<Message>) {
    if let (true, Some((Base::Floating | Base::Planar, place))) = (text.is_toml(), args.base) {
        let help = "leave `base` out; in the description the joints to `ground` say how the model is attached";
        errors.push(Message::new(place, "a TOML model states its own base", help));
    }
    for d in findings.iter().filter(|d| d.severity == Severity::Error) {
        let (message, help) = text.shown(d);
        errors.push(Message::new(text.place, message, help));
    }
    let Some(model) = model else { return };
    let names = || model.bodies.iter().map(|b| b.name.as_str()).chain(model.frames.iter().map(|f| f.name.as_str()));
    for (frame, place) in &args.frames {
        if names().any(|n| n == frame) {
            args.options.frames.push(frame.clone());
        } else {
            let help = did_you_mean(frame, names(), || format!("there are {}", list(names())));
            errors.push(Message::new(*place, format!("no frame or body is named {}", quote(frame)), help));
        }
    }
}

/// Tokens with some of them replaced, at any depth.
fn replace(tokens: TokenStream, with: &mut impl FnMut(&TokenTree) -> Option<TokenStream>) -> TokenStream {
    let mut out = Vec::new();
    for token in tokens {
        match (with(&token), token) {
            (Some(new), _) => out.extend(new),
            (None, TokenTree::Group(g)) => {
                let mut inner = Tokens::new(g.delimiter(), replace(g.stream(), with));
                inner.set_span(g.span());
                out.push(inner.into());
            }
            (None, other) => out.push(other),
        }
    }
    out.into_iter().collect()
}

/// Puts the user's name, visibility, attributes and runtime path into the generated tokens.
fn finish(tokens: TokenStream, name: &Name, runtime: Option<&TokenStream>) -> TokenStream {
    let runtime = runtime.cloned().unwrap_or_else(|| "::mbd_runtime".parse().unwrap_or_default());
    let ident = name.ident.to_string();
    let tokens = replace(tokens, &mut |token| match token {
        TokenTree::Ident(i) if *i == RUNTIME => Some(runtime.clone()),
        TokenTree::Ident(i) if *i == ident.as_str() => Some(TokenTree::from(name.ident.clone()).into()),
        _ => None,
    });
    let mut out: Vec<TokenTree> = name.attributes.clone().into_iter().collect();
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        let is = |t: Option<&TokenTree>, word: &str| matches!(t, Some(TokenTree::Ident(i)) if *i == word);
        if is(Some(&token), "pub") && is(tokens.peek(), "struct") && !name.visibility.is_empty() {
            out.extend(name.visibility.clone());
        } else {
            out.push(token);
        }
    }
    out.into_iter().collect()
}

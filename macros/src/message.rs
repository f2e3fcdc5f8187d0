//! Errors at a place in the user's source.

use proc_macro2::{Delimiter, Group, Ident, Literal, Punct, Spacing, Span, TokenStream, TokenTree};

/// The first and the last token to which a message refers.
#[derive(Clone, Copy, Debug)]
pub struct Place(pub Span, pub Span);

impl Place {
    /// All of some tokens, or `otherwise` if there is none.
    pub fn of(tokens: &[TokenTree], otherwise: Place) -> Place {
        match (tokens.first(), tokens.last()) {
            (Some(first), Some(last)) => Place(first.span(), last.span()),
            _ => otherwise,
        }
    }
}

impl From<Span> for Place {
    fn from(span: Span) -> Self {
        Place(span, span)
    }
}

/// One error: what is wrong, where, and what to do.
#[derive(Clone, Debug)]
pub struct Message {
    /// Tokens that are underlined.
    pub place: Place,
    /// What is wrong, then on a line of its own what to do about it.
    pub text: String,
}

impl Message {
    /// An error with its help.
    pub fn new(place: impl Into<Place>, message: impl AsRef<str>, help: impl AsRef<str>) -> Self {
        let (message, help) = (message.as_ref(), help.as_ref());
        let text = if help.is_empty() { message.to_string() } else { format!("{message}\nhelp: {help}") };
        Message { place: place.into(), text }
    }

    /// As an item of the expansion.
    pub fn compile_error(&self) -> TokenStream {
        let Place(start, end) = self.place;
        let mut tokens = core_path("compile_error", start);
        tokens.push(punct('!', start));
        let mut text = Literal::string(&self.text);
        text.set_span(end);
        let mut group = Group::new(Delimiter::Brace, TokenTree::from(text).into());
        group.set_span(end);
        tokens.push(group.into());
        tokens.into_iter().collect()
    }
}

/// `::core::name`
fn core_path(name: &str, span: Span) -> Vec<TokenTree> {
    let joint = |c| {
        let mut p = Punct::new(c, Spacing::Joint);
        p.set_span(span);
        TokenTree::from(p)
    };
    let ident = |name| TokenTree::from(Ident::new(name, span));
    vec![joint(':'), punct(':', span), ident("core"), joint(':'), punct(':', span), ident(name)]
}

fn punct(c: char, span: Span) -> TokenTree {
    let mut p = Punct::new(c, Spacing::Alone);
    p.set_span(span);
    p.into()
}

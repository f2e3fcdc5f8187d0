//! Runs emitted Rust without compiling it: the source text is parsed with `syn` and walked.
//!
//! The emitted language is tiny, and everything outside it is refused with a panic: `let` of a number or a pair, sums,
//! products, quotients, signs, sine-cosine pairs, roots, reads and writes of arrays at constant places, calls of parts.
//! A name that is defined twice in a function, or read before it is defined, is an error here although Rust would allow
//! the first.

use std::collections::HashMap;

use mbd_runtime::trig::sincos_f64;
use syn::{Expr, FnArg, ImplItem, Item, Lit, Pat, Stmt, Type, UnOp};

/// An array of any depth, flattened.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    pub dims: Vec<usize>,
    pub data: Vec<f64>,
}

impl Array {
    pub fn flat(data: &[f64]) -> Array {
        Array { dims: vec![data.len()], data: data.to_vec() }
    }

    fn place(&self, at: &[usize], what: &str) -> usize {
        assert_eq!(at.len(), self.dims.len(), "depth of {what}");
        at.iter().zip(&self.dims).fold(0, |sum, (k, n)| {
            assert!(k < n, "{what}{at:?} is out of bounds {:?}", self.dims);
            sum * n + k
        })
    }
}

/// The functions of an emitted `impl`.
pub struct Emitted {
    functions: HashMap<String, syn::ImplItemFn>,
}

/// Values by name while a function runs.
struct Frame {
    locals: HashMap<String, f64>,
    arrays: HashMap<String, Array>,
}

impl Emitted {
    /// Parses the source.
    pub fn parse(source: &str) -> Emitted {
        let file = syn::parse_file(source).unwrap_or_else(|e| panic!("emitted code is not Rust: {e}\n{source}"));
        let mut functions = HashMap::new();
        for item in file.items {
            let Item::Impl(block) = item else { continue };
            if block.trait_.is_some() {
                continue;
            }
            for item in block.items {
                if let ImplItem::Fn(f) = item {
                    let name = f.sig.ident.to_string();
                    assert!(functions.insert(name.clone(), f).is_none(), "{name} is emitted twice");
                }
            }
        }
        Emitted { functions }
    }

    /// Runs a function: arrays in by the names of arguments and fields (`q`, `self.tau`), arrays out by the names of the
    /// `&mut` arguments; a returned array is called `return`.
    pub fn run(&self, name: &str, inputs: &HashMap<String, Array>) -> HashMap<String, Array> {
        let f = &self.functions[name];
        let mut frame = Frame { locals: HashMap::new(), arrays: HashMap::new() };
        let mut outputs = Vec::new();
        for (name, array) in inputs.iter().filter(|(name, _)| name.starts_with("self.")) {
            frame.arrays.insert(name.clone(), array.clone());
        }
        for (arg, dims, mutable) in arguments(f) {
            if mutable {
                let n = dims.iter().product();
                frame.arrays.insert(arg.clone(), Array { dims, data: vec![f64::NAN; n] });
                outputs.push(arg);
            } else {
                let array = inputs.get(&arg).unwrap_or_else(|| panic!("{name} reads {arg}"));
                assert_eq!(dims, array.dims, "{name}: {arg}");
                frame.arrays.insert(arg, array.clone());
            }
        }
        let returned = self.body(f, &mut frame);
        let mut out: HashMap<String, Array> =
            outputs.into_iter().map(|o| (o.clone(), frame.arrays.remove(&o).expect("it was put there"))).collect();
        if let Some(values) = returned {
            out.insert("return".to_string(), Array::flat(&values));
        }
        out
    }

    fn body(&self, f: &syn::ImplItemFn, frame: &mut Frame) -> Option<Vec<f64>> {
        for stmt in &f.block.stmts {
            match stmt {
                Stmt::Local(local) => self.binding(local, frame),
                Stmt::Expr(Expr::Assign(a), Some(_)) => {
                    let value = number(&a.right, frame);
                    let (name, at) = place(&a.left);
                    let array = frame.arrays.get_mut(&name).unwrap_or_else(|| panic!("no array {name}"));
                    let k = array.place(&at, &name);
                    array.data[k] = value;
                }
                Stmt::Expr(Expr::MethodCall(call), Some(_)) => self.part(call, frame),
                Stmt::Expr(Expr::Array(list), None) => {
                    return Some(list.elems.iter().map(|e| number(e, frame)).collect());
                }
                other => panic!("unexpected statement {other:?}"),
            }
        }
        None
    }

    /// `let x = ..;`, `let (s, c) = ..sincos_f64(x);`, `let mut kept = [0.0; n];`
    fn binding(&self, local: &syn::Local, frame: &mut Frame) {
        let value = &local.init.as_ref().expect("every binding has a value").expr;
        match (&local.pat, &**value) {
            (Pat::Ident(name), Expr::Repeat(repeat)) => {
                assert!(name.mutability.is_some(), "an array that is never filled");
                let n = literal(&repeat.len) as usize;
                // Not zero: what is read before it is written must show.
                frame.arrays.insert(name.ident.to_string(), Array { dims: vec![n], data: vec![f64::NAN; n] });
            }
            (Pat::Ident(name), value) => {
                let x = number(value, frame);
                define(frame, name.ident.to_string(), x);
            }
            (Pat::Tuple(pair), Expr::Call(call)) => {
                assert!(path(&call.func).ends_with("::trig::sincos_f64"), "{}", path(&call.func));
                let (s, c) = sincos_f64(number(&call.args[0], frame));
                for (pat, x) in pair.elems.iter().zip([s, c]) {
                    match pat {
                        Pat::Ident(name) => define(frame, name.ident.to_string(), x),
                        Pat::Wild(_) => {}
                        other => panic!("unexpected pattern {other:?}"),
                    }
                }
            }
            other => panic!("unexpected binding {other:?}"),
        }
    }

    /// `self.rates_part1(q, p, &mut kept);`
    fn part(&self, call: &syn::ExprMethodCall, frame: &mut Frame) {
        let f = &self.functions[&call.method.to_string()];
        let mut inner = Frame { locals: HashMap::new(), arrays: HashMap::new() };
        let given: Vec<String> = call.args.iter().map(|a| path(strip(a))).collect();
        let names = arguments(f);
        assert_eq!(given.len(), names.len(), "arguments of {}", call.method);
        let fields: Vec<String> = frame.arrays.keys().filter(|k| k.starts_with("self.")).cloned().collect();
        let moves = given.iter().cloned().zip(names.iter().map(|(n, _, _)| n.clone()));
        let moves: Vec<(String, String)> = moves.chain(fields.iter().map(|f| (f.clone(), f.clone()))).collect();
        for (outer, name) in &moves {
            let array = frame.arrays.remove(outer).unwrap_or_else(|| panic!("no array {outer}"));
            inner.arrays.insert(name.clone(), array);
        }
        for (name, dims, _) in &names {
            assert_eq!(*dims, inner.arrays[name].dims, "{}: {name}", call.method);
        }
        assert!(self.body(f, &mut inner).is_none());
        for (outer, name) in moves {
            let array = inner.arrays.remove(&name).expect("it was put there");
            frame.arrays.insert(outer, array);
        }
    }
}

fn define(frame: &mut Frame, name: String, x: f64) {
    assert!(frame.locals.insert(name.clone(), x).is_none(), "{name} is defined twice");
}

/// Name, dimensions and mutability of every argument but `self`.
fn arguments(f: &syn::ImplItemFn) -> Vec<(String, Vec<usize>, bool)> {
    let typed = f.sig.inputs.iter().filter_map(|a| match a {
        FnArg::Typed(t) => Some(t),
        FnArg::Receiver(_) => None,
    });
    let one = |t: &syn::PatType| {
        let Pat::Ident(name) = &*t.pat else { panic!("unexpected argument") };
        let Type::Reference(reference) = &*t.ty else { panic!("arguments are references") };
        let mut dims = Vec::new();
        let mut ty = &*reference.elem;
        while let Type::Array(array) = ty {
            dims.push(literal(&array.len) as usize);
            ty = &array.elem;
        }
        (name.ident.to_string(), dims, reference.mutability.is_some())
    };
    typed.map(one).collect()
}

fn strip(e: &Expr) -> &Expr {
    match e {
        Expr::Reference(r) => &r.expr,
        Expr::Paren(p) => strip(&p.expr),
        e => e,
    }
}

/// `q`, `self.tau`, `::mbd_runtime::trig::sincos_f64`.
fn path(e: &Expr) -> String {
    match e {
        Expr::Path(p) => {
            let parts: Vec<String> = p.path.segments.iter().map(|s| s.ident.to_string()).collect();
            parts.join("::")
        }
        Expr::Field(f) => match &f.member {
            syn::Member::Named(name) => format!("{}.{name}", path(&f.base)),
            syn::Member::Unnamed(_) => panic!("a field without name"),
        },
        other => panic!("unexpected path {other:?}"),
    }
}

/// Name and indices of an array element.
fn place(e: &Expr) -> (String, Vec<usize>) {
    match e {
        Expr::Index(i) => {
            let (name, mut at) = place(&i.expr);
            at.push(literal(&i.index) as usize);
            (name, at)
        }
        e => (path(e), Vec::new()),
    }
}

fn literal(e: &Expr) -> f64 {
    let Expr::Lit(lit) = e else { panic!("expected a number, not {e:?}") };
    match &lit.lit {
        Lit::Float(x) => x.base10_parse().expect("a float"),
        Lit::Int(x) => x.base10_parse::<u64>().expect("an integer") as f64,
        other => panic!("unexpected literal {other:?}"),
    }
}

fn number(e: &Expr, frame: &Frame) -> f64 {
    match e {
        Expr::Lit(_) => literal(e),
        Expr::Paren(p) => number(&p.expr, frame),
        Expr::Path(_) => {
            let name = path(e);
            *frame.locals.get(&name).unwrap_or_else(|| panic!("{name} is not defined"))
        }
        Expr::Index(_) => {
            let (name, at) = place(e);
            let array = frame.arrays.get(&name).unwrap_or_else(|| panic!("no array {name}"));
            array.data[array.place(&at, &name)]
        }
        Expr::Unary(u) if matches!(u.op, UnOp::Neg(_)) => -number(&u.expr, frame),
        Expr::Binary(b) => {
            let (x, y) = (number(&b.left, frame), number(&b.right, frame));
            match b.op {
                syn::BinOp::Add(_) => x + y,
                syn::BinOp::Sub(_) => x - y,
                syn::BinOp::Mul(_) => x * y,
                syn::BinOp::Div(_) => x / y,
                _ => panic!("unexpected operator"),
            }
        }
        Expr::Call(call) if path(&call.func).ends_with("::Scalar::sqrt") => {
            mbd_runtime::Scalar::sqrt(number(&call.args[0], frame))
        }
        other => panic!("unexpected expression {other:?}"),
    }
}

//! Runs emitted Rust without compiling it: the source text is parsed with `syn`, lowered, and run.
//!
//! The emitted language is tiny, and everything outside it is refused with a panic: `let` of a number or a pair, sums,
//! products, quotients, signs, sine-cosine pairs, roots, reads and writes of arrays at constant places, calls of parts.
//! A name that is defined twice in a function is refused too, although Rust would allow it.

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

    /// Not zero: what is read before it is written must show.
    fn unset(dims: Vec<usize>) -> Array {
        let n = dims.iter().product();
        Array { dims, data: vec![f64::NAN; n] }
    }

    fn place(&self, at: &[usize]) -> usize {
        assert_eq!(at.len(), self.dims.len(), "depth of an array");
        at.iter().zip(&self.dims).fold(0, |sum, (k, n)| {
            assert!(k < n, "{at:?} is out of bounds {:?}", self.dims);
            sum * n + k
        })
    }
}

/// A number: locals and arrays by their indices in the function.
enum Number {
    Literal(f64),
    Local(usize),
    Item(usize, Vec<usize>),
    Negative(Box<Number>),
    Sum(Box<[Number; 2]>),
    Difference(Box<[Number; 2]>),
    Product(Box<[Number; 2]>),
    Quotient(Box<[Number; 2]>),
    Root(Box<Number>),
}

enum Step {
    Let(usize, Number),
    SinCos([Option<usize>; 2], Number),
    NewArray(usize, usize),
    Set(usize, Vec<usize>, Number),
    /// Name of the part and the arrays it is given.
    Part(String, Vec<usize>),
    Return(Vec<Number>),
}

/// A lowered function.
struct Function {
    /// Name, dimensions and mutability of every argument but `self`.
    arguments: Vec<(String, Vec<usize>, bool)>,
    /// Arguments first, then fields of `self` and own arrays.
    arrays: Vec<String>,
    locals: HashMap<String, usize>,
    steps: Vec<Step>,
}

/// The functions of an emitted `impl`.
pub struct Emitted {
    functions: HashMap<String, Function>,
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
                let ImplItem::Fn(f) = item else { continue };
                let name = f.sig.ident.to_string();
                if name == "new" {
                    continue;
                }
                assert!(functions.insert(name.clone(), Function::lower(&f)).is_none(), "{name} is emitted twice");
            }
        }
        Emitted { functions }
    }

    /// Runs a function: arrays in by the names of arguments and fields (`q`, `self.tau`), arrays out by the names of the
    /// `&mut` arguments; a returned array is called `return`.
    pub fn run(&self, name: &str, inputs: &HashMap<String, Array>) -> HashMap<String, Array> {
        let f = &self.functions[name];
        let given = f.arguments.iter().map(|(arg, dims, mutable)| {
            if *mutable {
                Array::unset(dims.clone())
            } else {
                inputs.get(arg).unwrap_or_else(|| panic!("{name} reads {arg}")).clone()
            }
        });
        let (returned, arrays) = self.call(f, given.collect(), inputs);
        let results = f.arguments.iter().zip(arrays).filter(|((_, _, mutable), _)| *mutable);
        let results = results.map(|((arg, _, _), array)| (arg.clone(), array));
        results.chain(returned.map(|values| ("return".to_string(), Array::flat(&values)))).collect()
    }

    /// Runs a function on its arguments and gives them back.
    fn call(
        &self,
        f: &Function,
        mut arrays: Vec<Array>,
        fields: &HashMap<String, Array>,
    ) -> (Option<Vec<f64>>, Vec<Array>) {
        for ((name, dims, _), array) in f.arguments.iter().zip(&arrays) {
            assert_eq!(*dims, array.dims, "{name}");
        }
        for name in &f.arrays[arrays.len()..] {
            arrays.push(match name.starts_with("self.") {
                true => fields.get(name).unwrap_or_else(|| panic!("no field {name}")).clone(),
                false => Array::unset(Vec::new()),
            });
        }
        let mut locals = vec![f64::NAN; f.locals.len()];
        for step in &f.steps {
            match step {
                Step::Let(to, x) => locals[*to] = x.value(&locals, &arrays),
                Step::SinCos(to, x) => {
                    let (s, c) = sincos_f64(x.value(&locals, &arrays));
                    for (to, x) in to.iter().zip([s, c]) {
                        to.iter().for_each(|to| locals[*to] = x);
                    }
                }
                Step::NewArray(to, n) => arrays[*to] = Array::unset(vec![*n]),
                Step::Set(to, at, x) => {
                    let x = x.value(&locals, &arrays);
                    let place = arrays[*to].place(at);
                    arrays[*to].data[place] = x;
                }
                Step::Part(name, given) => {
                    let part = &self.functions[name];
                    assert_eq!(given.len(), part.arguments.len(), "arguments of {name}");
                    let lent = given.iter().map(|k| std::mem::replace(&mut arrays[*k], Array::flat(&[])));
                    let (returned, back) = self.call(part, lent.collect(), fields);
                    assert!(returned.is_none());
                    for (k, array) in given.iter().zip(back) {
                        arrays[*k] = array;
                    }
                }
                Step::Return(list) => return (Some(list.iter().map(|x| x.value(&locals, &arrays)).collect()), arrays),
            }
        }
        (None, arrays)
    }
}

impl Number {
    fn value(&self, locals: &[f64], arrays: &[Array]) -> f64 {
        let of = |x: &Number| x.value(locals, arrays);
        match self {
            Number::Literal(x) => *x,
            Number::Local(k) => locals[*k],
            Number::Item(k, at) => arrays[*k].data[arrays[*k].place(at)],
            Number::Negative(x) => -of(x),
            Number::Sum(x) => of(&x[0]) + of(&x[1]),
            Number::Difference(x) => of(&x[0]) - of(&x[1]),
            Number::Product(x) => of(&x[0]) * of(&x[1]),
            Number::Quotient(x) => of(&x[0]) / of(&x[1]),
            Number::Root(x) => mbd_runtime::Scalar::sqrt(of(x)),
        }
    }
}

impl Function {
    fn lower(f: &syn::ImplItemFn) -> Function {
        let arguments = arguments(f);
        let arrays = arguments.iter().map(|(name, _, _)| name.clone()).collect();
        let mut out = Function { arguments, arrays, locals: HashMap::new(), steps: Vec::new() };
        for stmt in &f.block.stmts {
            let step = match stmt {
                Stmt::Local(local) => out.binding(local),
                Stmt::Expr(Expr::Assign(a), Some(_)) => {
                    let (array, at) = out.place(&a.left);
                    Step::Set(array, at, out.number(&a.right))
                }
                // self.rates_part1(q, p, &mut kept);
                Stmt::Expr(Expr::MethodCall(call), Some(_)) => {
                    let given = call.args.iter().map(|a| match a {
                        Expr::Reference(r) => out.array(path(&r.expr)),
                        a => out.array(path(a)),
                    });
                    Step::Part(call.method.to_string(), given.collect())
                }
                Stmt::Expr(Expr::Array(list), None) => Step::Return(list.elems.iter().map(|e| out.number(e)).collect()),
                other => panic!("unexpected statement {other:?}"),
            };
            out.steps.push(step);
        }
        out
    }

    /// `let x = ..;`, `let (s, c) = ..sincos_f64(x);`, `let mut kept = [0.0; n];`
    fn binding(&mut self, local: &syn::Local) -> Step {
        let value = &local.init.as_ref().expect("every binding has a value").expr;
        match (&local.pat, &**value) {
            (Pat::Ident(name), Expr::Repeat(repeat)) => {
                assert!(name.mutability.is_some(), "an array that is never filled");
                Step::NewArray(self.array(name.ident.to_string()), literal(&repeat.len) as usize)
            }
            (Pat::Ident(name), value) => {
                let x = self.number(value);
                Step::Let(self.define(name.ident.to_string()), x)
            }
            (Pat::Tuple(pair), Expr::Call(call)) => {
                assert!(path(&call.func).ends_with("::trig::sincos_f64"), "{}", path(&call.func));
                let x = self.number(&call.args[0]);
                assert_eq!(pair.elems.len(), 2);
                let to = [&pair.elems[0], &pair.elems[1]].map(|pat| match pat {
                    Pat::Ident(name) => Some(self.define(name.ident.to_string())),
                    Pat::Wild(_) => None,
                    other => panic!("unexpected pattern {other:?}"),
                });
                Step::SinCos(to, x)
            }
            other => panic!("unexpected binding {other:?}"),
        }
    }

    fn define(&mut self, name: String) -> usize {
        let k = self.locals.len();
        assert!(self.locals.insert(name.clone(), k).is_none(), "{name} is defined twice");
        k
    }

    fn array(&mut self, name: String) -> usize {
        self.arrays.iter().position(|a| *a == name).unwrap_or_else(|| {
            self.arrays.push(name);
            self.arrays.len() - 1
        })
    }

    /// An array and the indices of an element.
    fn place(&mut self, e: &Expr) -> (usize, Vec<usize>) {
        match e {
            Expr::Index(i) => {
                let (array, mut at) = self.place(&i.expr);
                at.push(literal(&i.index) as usize);
                (array, at)
            }
            e => (self.array(path(e)), Vec::new()),
        }
    }

    fn number(&mut self, e: &Expr) -> Number {
        match e {
            Expr::Lit(_) => Number::Literal(literal(e)),
            Expr::Paren(p) => self.number(&p.expr),
            Expr::Path(_) => {
                let name = path(e);
                Number::Local(*self.locals.get(&name).unwrap_or_else(|| panic!("{name} is not defined")))
            }
            Expr::Index(_) => {
                let (array, at) = self.place(e);
                Number::Item(array, at)
            }
            Expr::Unary(u) if matches!(u.op, UnOp::Neg(_)) => Number::Negative(Box::new(self.number(&u.expr))),
            Expr::Binary(b) => {
                let both = Box::new([self.number(&b.left), self.number(&b.right)]);
                match b.op {
                    syn::BinOp::Add(_) => Number::Sum(both),
                    syn::BinOp::Sub(_) => Number::Difference(both),
                    syn::BinOp::Mul(_) => Number::Product(both),
                    syn::BinOp::Div(_) => Number::Quotient(both),
                    _ => panic!("unexpected operator"),
                }
            }
            Expr::Call(call) if path(&call.func).ends_with("::Scalar::sqrt") => {
                Number::Root(Box::new(self.number(&call.args[0])))
            }
            other => panic!("unexpected expression {other:?}"),
        }
    }
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

fn literal(e: &Expr) -> f64 {
    let Expr::Lit(lit) = e else { panic!("expected a number, not {e:?}") };
    match &lit.lit {
        Lit::Float(x) => x.base10_parse().expect("a float"),
        Lit::Int(x) => x.base10_parse::<u64>().expect("an integer") as f64,
        other => panic!("unexpected literal {other:?}"),
    }
}

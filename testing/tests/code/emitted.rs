//! Runs emitted Rust without compiling it: the source text is parsed with `syn`, lowered, and run.
//!
//! Only the kernels run here, for one lane; `compiled.rs` tests the functions around them, and lanes. The emitted
//! language is small: `let` of a number or a pair, sums, products, quotients, signs, sine-cosine pairs one by one or
//! all at once, roots, guarded reciprocals, reads and writes of arrays at constant places, `for` over lanes. Anything
//! else panics. A name that is defined twice in a block panics too, although Rust would allow it.

use std::collections::HashMap;

use mbd_runtime::trig::sincos_f64;
use syn::{Expr, FnArg, ImplItem, Item, Lit, Pat, Stmt, Type, UnOp};

/// An expression for a number. Locals and arrays are given by their indices in the function.
enum Number {
    Literal(f64),
    Local(usize),
    /// An item of an array: indices of the array and of the item.
    Item(usize, usize),
    Negative(Box<Number>),
    Sum(Box<[Number; 2]>),
    Difference(Box<[Number; 2]>),
    Product(Box<[Number; 2]>),
    Quotient(Box<[Number; 2]>),
    Root(Box<Number>),
    /// The reciprocal `1 / a` if `a` is above `b`, else zero.
    ReciprocalAbove(Box<[Number; 2]>),
}

enum Step {
    Let(usize, Number),
    SinCos([Option<usize>; 2], Number),
    NewArray(usize, usize),
    Set(usize, usize, Number),
    /// Arrays of sines and cosines of an array of angles.
    AllSines([usize; 2], usize),
}

/// A lowered kernel.
struct Function {
    /// Name and mutability of every argument.
    arguments: Vec<(String, bool)>,
    /// Names of the arguments, then of the function's own arrays.
    arrays: Vec<String>,
    locals: Vec<HashMap<String, usize>>,
    count: usize,
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
                let Some(name) = name.strip_suffix("_kernel") else { continue };
                assert!(functions.insert(name.to_string(), Function::lower(&f)).is_none(), "{name} is emitted twice");
            }
        }
        Emitted { functions }
    }

    /// Runs a kernel. Inputs are flat arrays by the names of the arguments (`q`, `tau`); outputs are arrays by the
    /// names of the `&mut` arguments.
    pub fn run(&self, name: &str, inputs: &HashMap<String, Vec<f64>>) -> HashMap<String, Vec<f64>> {
        let f = &self.functions[name];
        // Output arrays start empty and locals with NaN, so that a read before the write shows.
        let mut arrays: Vec<Vec<f64>> = vec![Vec::new(); f.arrays.len()];
        for (array, (arg, mutable)) in arrays.iter_mut().zip(&f.arguments) {
            if !mutable {
                *array = inputs.get(arg).unwrap_or_else(|| panic!("{name} reads {arg}")).clone();
            }
        }
        let mut locals = vec![f64::NAN; f.count];
        for step in &f.steps {
            match step {
                Step::Let(to, x) => locals[*to] = x.value(&locals, &arrays),
                Step::SinCos(to, x) => {
                    let (s, c) = sincos_f64(x.value(&locals, &arrays));
                    for (to, x) in to.iter().zip([s, c]) {
                        to.iter().for_each(|to| locals[*to] = x);
                    }
                }
                Step::NewArray(to, n) => arrays[*to] = vec![f64::NAN; *n],
                Step::Set(to, k, x) => {
                    let x = x.value(&locals, &arrays);
                    let array = &mut arrays[*to];
                    // Results are written in order. Arrays grow here because the text does not contain their lengths.
                    if *k == array.len() {
                        array.push(x);
                    } else {
                        array[*k] = x;
                    }
                }
                Step::AllSines(to, from) => {
                    let pairs: Vec<(f64, f64)> = arrays[*from].iter().map(|x| sincos_f64(*x)).collect();
                    arrays[to[0]] = pairs.iter().map(|p| p.0).collect();
                    arrays[to[1]] = pairs.iter().map(|p| p.1).collect();
                }
            }
        }
        let results = f.arguments.iter().zip(arrays).filter(|((_, mutable), _)| *mutable);
        results.map(|((arg, _), array)| (arg.clone(), array)).collect()
    }
}

impl Number {
    fn value(&self, locals: &[f64], arrays: &[Vec<f64>]) -> f64 {
        let of = |x: &Number| x.value(locals, arrays);
        match self {
            Number::Literal(x) => *x,
            Number::Local(k) => locals[*k],
            Number::Item(array, k) => arrays[*array][*k],
            Number::Negative(x) => -of(x),
            Number::Sum(x) => of(&x[0]) + of(&x[1]),
            Number::Difference(x) => of(&x[0]) - of(&x[1]),
            Number::Product(x) => of(&x[0]) * of(&x[1]),
            Number::Quotient(x) => of(&x[0]) / of(&x[1]),
            Number::ReciprocalAbove(x) => mbd_runtime::Scalar::reciprocal_above(of(&x[0]), of(&x[1])),
            Number::Root(x) => mbd_runtime::Scalar::sqrt(of(x)),
        }
    }
}

impl Function {
    fn lower(f: &syn::ImplItemFn) -> Function {
        let arguments = arguments(f);
        let arrays = arguments.iter().map(|(name, _)| name.clone()).collect();
        let mut out = Function { arguments, arrays, locals: vec![HashMap::new()], count: 0, steps: Vec::new() };
        out.block(&f.block.stmts);
        out
    }

    fn block(&mut self, statements: &[Stmt]) {
        for stmt in statements {
            let step = match stmt {
                Stmt::Local(local) => {
                    if let Some(syn::LocalInit { expr, .. }) = &local.init {
                        if let Expr::Block(inner) = &**expr {
                            self.inner_block(&local.pat, &inner.block.stmts);
                            continue;
                        }
                    }
                    self.binding(local)
                }
                // angles[0][l] = q_1;
                Stmt::Expr(Expr::Assign(a), Some(_)) => {
                    let (array, k) = self.place(&a.left);
                    Step::Set(array, k, self.number(&a.right))
                }
                // qd.give(0, &results[4]);
                Stmt::Expr(Expr::MethodCall(call), Some(_)) if call.method == "give" => {
                    let Expr::Reference(result) = &call.args[1] else { panic!("results are lent") };
                    let Expr::Index(result) = &*result.expr else { panic!("a result") };
                    let result = Number::Item(self.array(path(&result.expr)), literal(&result.index) as usize);
                    Step::Set(self.array(path(&call.receiver)), literal(&call.args[0]) as usize, result)
                }
                // for l in 0..LANES { .. }
                Stmt::Expr(Expr::ForLoop(all), None) => {
                    let Expr::Range(range) = &*all.expr else { panic!("a loop over lanes") };
                    assert_eq!(range.end.as_deref().map(path).as_deref(), Some("LANES"));
                    self.locals.push(HashMap::new());
                    self.block(&all.body.stmts);
                    self.locals.pop();
                    continue;
                }
                other => panic!("unexpected statement {other:?}"),
            };
            self.steps.push(step);
        }
    }

    /// `let (a, b) = { let a = ..; let b = ..; (a, b) };`
    fn inner_block(&mut self, names: &Pat, statements: &[Stmt]) {
        let (Stmt::Expr(kept, None), first) = statements.split_last().expect("a block has a value") else {
            panic!("a block has a value")
        };
        self.locals.push(self.locals.last().expect("a block").clone());
        self.block(first);
        let inner = self.locals.pop().expect("the block");
        let (names, kept): (Vec<&Pat>, Vec<&Expr>) = match (names, kept) {
            (Pat::Tuple(names), Expr::Tuple(kept)) => (names.elems.iter().collect(), kept.elems.iter().collect()),
            other => (vec![names], vec![other.1]),
        };
        assert_eq!(names.len(), kept.len());
        for (name, kept) in names.iter().zip(kept) {
            let Pat::Ident(name) = name else { panic!("unexpected pattern {name:?}") };
            assert_eq!(name.ident.to_string(), path(kept), "values keep their names");
            let at = *inner.get(&path(kept)).unwrap_or_else(|| panic!("{} is not defined", path(kept)));
            let scope = self.locals.last_mut().expect("a block");
            assert!(scope.insert(path(kept), at).is_none(), "{} is defined twice", path(kept));
        }
    }

    /// `let x = ..;`, `let (s, c) = ..pair_f64::<..>(x);`, `let mut angles = ..Rows([[0.0; LANES]; n]);`,
    /// `let (sines, cosines) = ..pairs_f64::<..>(&angles);`
    fn binding(&mut self, local: &syn::Local) -> Step {
        let value = &local.init.as_ref().expect("every binding has a value").expr;
        match (&local.pat, &**value) {
            (Pat::Ident(name), Expr::Call(call)) if path(&call.func).ends_with("::kernel::Rows") => {
                let Expr::Repeat(repeat) = &call.args[0] else { panic!("rows of lanes") };
                assert!(name.mutability.is_some(), "an array that is never filled");
                Step::NewArray(self.array(name.ident.to_string()), literal(&repeat.len) as usize)
            }
            (Pat::Ident(name), value) => {
                let x = self.number(value);
                Step::Let(self.define(name.ident.to_string()), x)
            }
            (Pat::Tuple(pair), Expr::Call(call)) => {
                assert_eq!(pair.elems.len(), 2);
                let names = [&pair.elems[0], &pair.elems[1]].map(|pat| match pat {
                    Pat::Ident(name) => Some(name.ident.to_string()),
                    Pat::Wild(_) => None,
                    other => panic!("unexpected pattern {other:?}"),
                });
                if path(&call.func).ends_with("::trig::pairs_f64") {
                    let Expr::Reference(angles) = &call.args[0] else { panic!("angles are lent") };
                    let angles = self.array(path(&angles.expr));
                    return Step::AllSines(names.map(|name| self.array(name.expect("a name"))), angles);
                }
                assert!(path(&call.func).ends_with("::trig::pair_f64"), "{}", path(&call.func));
                let x = self.number(&call.args[0]);
                Step::SinCos(names.map(|name| name.map(|name| self.define(name))), x)
            }
            other => panic!("unexpected binding {other:?}"),
        }
    }

    fn define(&mut self, name: String) -> usize {
        let scope = self.locals.last_mut().expect("a block");
        assert!(scope.insert(name.clone(), self.count).is_none(), "{name} is defined twice");
        self.count += 1;
        self.count - 1
    }

    fn array(&mut self, name: String) -> usize {
        self.arrays.iter().position(|a| *a == name).unwrap_or_else(|| {
            self.arrays.push(name);
            self.arrays.len() - 1
        })
    }

    /// `angles[0][l]`: array and place.
    fn place(&mut self, e: &Expr) -> (usize, usize) {
        let Expr::Index(lane) = e else { panic!("unexpected place {e:?}") };
        assert_eq!(path(&lane.index), "l");
        let Expr::Index(item) = &*lane.expr else { panic!("unexpected place {e:?}") };
        (self.array(path(&item.expr)), literal(&item.index) as usize)
    }

    fn number(&mut self, e: &Expr) -> Number {
        match e {
            Expr::Lit(_) => Number::Literal(literal(e)),
            Expr::Paren(p) => self.number(&p.expr),
            Expr::Path(_) => {
                let name = path(e);
                Number::Local(
                    *self.locals.last().and_then(|l| l.get(&name)).unwrap_or_else(|| panic!("{name} is not defined")),
                )
            }
            Expr::Index(_) => {
                let (array, k) = self.place(e);
                Number::Item(array, k)
            }
            // q.get(1, l)
            Expr::MethodCall(call) if call.method == "get" => {
                assert_eq!(path(&call.args[1]), "l");
                Number::Item(self.array(path(&call.receiver)), literal(&call.args[0]) as usize)
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
            Expr::Call(call) if path(&call.func).ends_with("::Scalar::reciprocal_above") => {
                Number::ReciprocalAbove(Box::new([self.number(&call.args[0]), self.number(&call.args[1])]))
            }
            other => panic!("unexpected expression {other:?}"),
        }
    }
}

/// Name and mutability of every argument.
fn arguments(f: &syn::ImplItemFn) -> Vec<(String, bool)> {
    let one = |argument: &FnArg| {
        let FnArg::Typed(t) = argument else { panic!("a kernel has no self") };
        let Pat::Ident(name) = &*t.pat else { panic!("unexpected argument") };
        let Type::Reference(reference) = &*t.ty else { panic!("arguments are references") };
        (name.ident.to_string(), reference.mutability.is_some())
    };
    f.sig.inputs.iter().map(one).collect()
}

/// `q`, `::mbd_runtime::trig::pair_f64`.
fn path(e: &Expr) -> String {
    match e {
        Expr::Path(p) => {
            let parts: Vec<String> = p.path.segments.iter().map(|s| s.ident.to_string()).collect();
            parts.join("::")
        }
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

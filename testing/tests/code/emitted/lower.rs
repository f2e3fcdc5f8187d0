//! Lowers the trees of emitted source.

use std::collections::HashMap;

use super::trees::Tree::{self, Curly, Round, Square, Word};
use super::{Expression, Function, Number, Operand, Role, Step};

/// The kernels of the `impl` blocks that are of no trait, with the names of their outputs.
pub fn kernels<'a>(source: &[Tree<'a>]) -> Vec<(&'a str, Function)> {
    let mut kernels = Vec::new();
    for (head, body) in items(source) {
        let of_trait = head.iter().any(|tree| matches!(tree, Word("for")));
        if of_trait || !head.iter().any(|tree| matches!(tree, Word("impl"))) {
            continue;
        }
        for (head, body) in items(body) {
            let at = head.iter().position(|tree| matches!(tree, Word("fn")));
            let Some([_, Word(name), types @ .., Round(arguments)]) = at.map(|at| &head[at..]) else { continue };
            let Some(name) = name.strip_suffix("_kernel") else { continue };
            let [Word("<"), Word("A"), Word(":"), Word(arithmetic), Word(","), lanes @ .., Word(">")] = types else {
                panic!("unexpected types {types:?}")
            };
            let is_number = matches!(lanes, [Word("const"), Word("LANES"), Word(":"), Word("usize")]);
            assert!(is_number && arithmetic.ends_with("::kernel::Arithmetic"), "unexpected types {types:?}");
            kernels.push((name, Lowering::function(arguments, body)));
        }
    }
    kernels
}

/// Items that have a body in braces: what is before the body, and the body.
fn items<'t, 'a>(mut rest: &'t [Tree<'a>]) -> Vec<(&'t [Tree<'a>], &'t [Tree<'a>])> {
    let mut items = Vec::new();
    while let Some(end) = rest.iter().position(|tree| matches!(tree, Curly(_) | Word(";"))) {
        if let Curly(body) = &rest[end] {
            items.push((&rest[..end], body.as_slice()));
        }
        rest = &rest[end + 1..];
    }
    assert!(rest.is_empty(), "an item does not end: {rest:?}");
    items
}

/// A kernel while it is lowered.
#[derive(Default)]
struct Lowering<'a> {
    function: Function,
    arrays: HashMap<&'a str, usize>,
    /// Locals that are visible, and the names that each open block has defined.
    locals: HashMap<&'a str, usize>,
    blocks: Vec<Vec<&'a str>>,
    /// Number of results that each array has been given.
    given: HashMap<usize, usize>,
}

impl<'a> Lowering<'a> {
    fn function(arguments: &[Tree<'a>], body: &[Tree<'a>]) -> Function {
        let mut out = Lowering::default();
        for argument in list(arguments) {
            // q: &(impl ..::Read<f64> + ?Sized), qd: &mut (impl ..::Write<f64> + ?Sized)
            let (name, ty, access, role) = match argument {
                [Word(name), Word(":"), Word("&"), Round(ty)] => (name, ty, "::kernel::Read", Role::Read),
                [Word(name), Word(":"), Word("&"), Word("mut"), Round(ty)] => {
                    (name, ty, "::kernel::Write", Role::Written)
                }
                other => panic!("unexpected argument {other:?}"),
            };
            let [Word("impl"), Word(of), Word("<"), Word("f64"), Word(">"), Word("+"), Word("?"), Word("Sized")] =
                ty[..]
            else {
                panic!("unexpected type {ty:?}")
            };
            assert!(of.ends_with(access), "{of}");
            out.array(name, role);
        }
        let value = out.block(body);
        assert!(value.is_empty(), "a kernel returns nothing: {value:?}");
        out.function
    }

    /// Lowers the statements of a block. Returns the block's value.
    fn block<'t>(&mut self, mut rest: &'t [Tree<'a>]) -> &'t [Tree<'a>] {
        self.blocks.push(Vec::new());
        loop {
            if let [Word("for"), Word("l"), Word("in"), Word("0"), Word(".."), Word("LANES"), Curly(body), after @ ..] =
                rest
            {
                let value = self.block(body);
                assert!(value.is_empty(), "a loop has no value: {value:?}");
                self.close(&[]);
                rest = after;
                continue;
            }
            // if LANES == 1 && ..::kernel::VECTORS { return Self::rates_together::<A>(..); }
            // What computes like branches together is compared with the interpreter before it is text, and compiled.
            if let [Word("if"), Word("LANES"), ..] = rest {
                let end = rest.iter().position(|tree| matches!(tree, Curly(_))).expect("a block after a condition");
                rest = &rest[end + 1..];
                continue;
            }
            let Some(end) = rest.iter().position(|tree| matches!(tree, Word(";"))) else { return rest };
            self.statement(&rest[..end]);
            rest = &rest[end + 1..];
        }
    }

    /// Ends a block. Of the names that it has defined, the given ones become names of the block around it.
    fn close(&mut self, kept: &[&'a str]) {
        let made = self.blocks.pop().expect("a block");
        for name in kept {
            assert!(made.contains(name), "{name} is not defined in the block that returns it");
            self.blocks.last_mut().expect("a block around this one").push(name);
        }
        for name in made.iter().filter(|name| !kept.contains(name)) {
            self.locals.remove(name);
        }
    }

    fn statement(&mut self, statement: &[Tree<'a>]) {
        let step = match statement {
            // let (a, b) = { let a = ..; let b = ..; (a, b) };
            [Word("let"), names, Word("="), Curly(block)] => {
                let (names, value) = (self::names(std::slice::from_ref(names)), self.block(block));
                assert_eq!(names, self::names(value), "values keep their names");
                return self.close(&names);
            }
            // let mut angles = ..::kernel::Rows([[0.0; LANES]; 7]);
            [Word("let"), Word("mut"), Word(name), Word("="), Word(path), Round(rows)] => {
                assert!(path.ends_with("::kernel::Rows"), "{path}");
                let [Square(rows)] = &rows[..] else { panic!("unexpected rows {rows:?}") };
                let [Square(row), Word(";"), Word(n)] = &rows[..] else { panic!("unexpected rows {rows:?}") };
                assert!(matches!(row[..], [Word("0.0"), Word(";"), Word("LANES")]), "unexpected row {row:?}");
                self.array(name, Role::Filled(index(n)));
                return;
            }
            // let mut result_0 = [0.0; LANES];
            [Word("let"), Word("mut"), Word(name), Word("="), Square(row)] => {
                assert!(matches!(row[..], [Word("0.0"), Word(";"), Word("LANES")]), "unexpected row {row:?}");
                self.array(name, Role::Filled(1));
                return;
            }
            // let (s, c) = ..::trig::pair_f64::<..>(x);
            // let (sines, cosines) = ..::trig::pairs_f64::<..>(&angles);
            [Word("let"), Round(pair), Word("="), Word(path), Word("::"), Word("<"), types @ .., Word(">"), Round(of)] =>
            {
                let [Word(first), Word(","), Word(second)] = pair[..] else { panic!("unexpected pair {pair:?}") };
                match path {
                    path if path.ends_with("::trig::pairs_f64") => self.all_sines([first, second], types, of),
                    path if path.ends_with("::trig::pair_f64") => {
                        assert!(matches!(types, [Word(plain)] if plain.ends_with("::kernel::Plain")), "{types:?}");
                        let angle = self.expression(of);
                        Step::SinCos([first, second].map(|name| (name != "_").then(|| self.define(name))), angle)
                    }
                    path => panic!("unexpected function {path}"),
                }
            }
            [Word("let"), Word(name), Word("="), value @ ..] => {
                let value = self.expression(value);
                Step::Let(self.define(name), value)
            }
            // angles[0][l] = q_1;
            [Word(array), Square(k), Square(lane), Word("="), value @ ..] => self.set(self.item(array, k, lane), value),
            // rows[9] = sines[0];
            [Word(array), Square(k), Word("="), Word(from), Square(j)] if !matches!(k[..], [Word("l")]) => {
                let lane = [Word("l")];
                let number = self.item(from, j, &lane);
                let Number::Item(array, k) = self.item(array, k, &lane) else { unreachable!("an item") };
                Step::Set(array, k, Expression::One(Operand { negative: false, number }))
            }
            // result_0[l] = v_1;
            [Word(array), Square(lane), Word("="), value @ ..] => self.set(self.only_item(array, lane), value),
            // qd.give(0, &result_4); or qd.give(0, &rows[4]);
            [Word(to), Word("."), Word("give"), Round(result)] => {
                let [Word(at), Word(","), from @ ..] = &result[..] else { panic!("unexpected result {result:?}") };
                self.give(to, index(at), from)
            }
            // qd.give_pair(0, [&result_4, &result_5]); or with rows
            [Word(to), Word("."), Word("give_pair"), Round(result)] => {
                let [Word(at), Word(","), Square(pair)] = &result[..] else { panic!("unexpected results {result:?}") };
                let [one, two] = list(pair)[..] else { panic!("unexpected pair {pair:?}") };
                let first = self.give(to, index(at), one);
                self.function.steps.push(first);
                self.give(to, index(at) + 1, two)
            }
            other => panic!("unexpected statement {other:?}"),
        };
        self.function.steps.push(step);
    }

    fn set(&self, item: Number, value: &[Tree<'a>]) -> Step {
        let Number::Item(array, k) = item else { unreachable!("an item") };
        let (name, role) = &self.function.arrays[array];
        assert!(matches!(role, Role::Filled(_)), "{name} cannot be filled");
        Step::Set(array, k, self.expression(value))
    }

    /// A result is written: number `at` of the array `to`, from an array of one row or a row of another.
    fn give(&mut self, to: &'a str, at: usize, from: &[Tree<'a>]) -> Step {
        let (from, k) = match from {
            [Word("&"), Word(from)] => (*from, 0),
            [Word("&"), Word(from), Square(k)] => match k[..] {
                [Word(k)] => (*from, index(k)),
                _ => panic!("unexpected row {k:?}"),
            },
            other => panic!("unexpected result {other:?}"),
        };
        let [to, from] = [to, from].map(|name| self.known(name));
        assert!(self.function.arrays[to].1 == Role::Written, "{:?} is not written", self.function.arrays[to].0);
        let given = self.given.entry(to).or_default();
        assert_eq!(at, *given, "results are written in order");
        *given += 1;
        Step::Give(to, from, self.within(from, k))
    }

    fn all_sines(&mut self, names: [&'a str; 2], types: &[Tree<'a>], of: &[Tree<'a>]) -> Step {
        let [Word(plain), Word(","), Word("LANES"), Word(","), Word(n)] = types else {
            panic!("unexpected types {types:?}")
        };
        let [Word("&"), Word(angles)] = of else { panic!("unexpected angles {of:?}") };
        let (angles, n) = (self.known(angles), index(n));
        assert!(plain.ends_with("::kernel::Plain"), "{plain}");
        assert!(self.function.arrays[angles].1 == Role::Filled(n), "{n} angles");
        Step::AllSines(names.map(|name| self.array(name, Role::Computed(n))), angles)
    }

    /// The index of a local that is defined here.
    fn define(&mut self, name: &'a str) -> usize {
        let local = self.function.locals;
        assert!(is_name(name), "unexpected pattern {name}");
        assert!(!self.arrays.contains_key(name), "{name} hides an array");
        assert!(self.locals.insert(name, local).is_none(), "{name} is defined twice");
        self.blocks.last_mut().expect("a block").push(name);
        self.function.locals += 1;
        local
    }

    /// The index of an array that is defined here.
    fn array(&mut self, name: &'a str, role: Role) -> usize {
        let array = self.function.arrays.len();
        assert!(is_name(name), "unexpected pattern {name}");
        assert!(!self.locals.contains_key(name), "{name} hides a number");
        assert!(self.arrays.insert(name, array).is_none(), "{name} is defined twice");
        self.function.arrays.push((name.to_string(), role));
        array
    }

    fn known(&self, array: &str) -> usize {
        *self.arrays.get(array).unwrap_or_else(|| panic!("array {array} is not defined"))
    }

    /// An index that is checked against the length of the array, where the text contains it.
    fn within(&self, array: usize, k: usize) -> usize {
        let (name, role) = &self.function.arrays[array];
        match role {
            Role::Filled(n) | Role::Computed(n) => assert!(k < *n, "{name}[{k}] of {n}"),
            Role::Read => {}
            Role::Written => panic!("{name} is read"),
        }
        k
    }

    /// `angles[0][l]`
    fn item(&self, array: &str, k: &[Tree], lane: &[Tree]) -> Number {
        let ([Word(k)], [Word("l")]) = (k, lane) else { panic!("unexpected place {array}{k:?}{lane:?}") };
        let array = self.known(array);
        let is_local = matches!(self.function.arrays[array].1, Role::Filled(_) | Role::Computed(_));
        assert!(is_local, "{} is indexed", self.function.arrays[array].0);
        Number::Item(array, self.within(array, index(k)))
    }

    /// `result_0[l]`
    fn only_item(&self, array: &str, lane: &[Tree]) -> Number {
        let number = self.item(array, &[Word("0")], lane);
        assert!(self.function.arrays[self.known(array)].1 == Role::Filled(1), "{array} has several rows");
        number
    }

    fn expression(&self, text: &[Tree<'a>]) -> Expression {
        let alone = |text: &[Tree<'a>]| match self.operand(text) {
            (x, []) => x,
            (_, rest) => panic!("unexpected {rest:?}"),
        };
        if let [Word(path), Round(arguments)] = text {
            return match (*path, &list(arguments)[..]) {
                (path, [x]) if path.ends_with("::Scalar::sqrt") => Expression::Root(alone(x)),
                (path, [a, b]) if path.ends_with("::Scalar::reciprocal_above") => {
                    Expression::ReciprocalAbove([alone(a), alone(b)])
                }
                other => panic!("unexpected call {other:?}"),
            };
        }
        match self.operand(text) {
            (a, []) => Expression::One(a),
            (a, [Word(operator), rest @ ..]) => {
                let both = [a, alone(rest)];
                match *operator {
                    "+" => Expression::Sum(both),
                    "-" => Expression::Difference(both),
                    "*" => Expression::Product(both),
                    "/" => Expression::Quotient(both),
                    other => panic!("unexpected operator {other}"),
                }
            }
            (_, rest) => panic!("unexpected {rest:?}"),
        }
    }

    /// The operand at the start of a text, and the rest of the text.
    fn operand<'t>(&self, text: &'t [Tree<'a>]) -> (Operand, &'t [Tree<'a>]) {
        let (negative, text) = match text {
            [Word("-"), text @ ..] => (true, text),
            text => (false, text),
        };
        let (number, rest) = match text {
            // q.get(1, l)
            [Word(array), Word("."), Word("get"), Round(place), rest @ ..] => {
                let [Word(k), Word(","), Word("l")] = place[..] else { panic!("unexpected place {place:?}") };
                let array = self.known(array);
                assert!(self.function.arrays[array].1 == Role::Read, "{:?} is not read", self.function.arrays[array].0);
                (Number::Item(array, index(k)), rest)
            }
            [Word(array), Square(k), Square(lane), rest @ ..] => (self.item(array, k, lane), rest),
            [Word(array), Square(lane), rest @ ..] => (self.only_item(array, lane), rest),
            [Word(name), rest @ ..] if is_name(name) => {
                (Number::Local(*self.locals.get(name).unwrap_or_else(|| panic!("{name} is not defined"))), rest)
            }
            [Word(literal), rest @ ..] => {
                assert!(literal.contains(['.', 'e']), "{literal} is not a floating-point number");
                (Number::Literal(literal.parse().unwrap_or_else(|e| panic!("{literal}: {e}"))), rest)
            }
            other => panic!("unexpected operand {other:?}"),
        };
        (Operand { negative, number }, rest)
    }
}

fn is_name(word: &str) -> bool {
    word != "_" && !word.contains(':') && word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
}

fn index(word: &str) -> usize {
    word.parse().unwrap_or_else(|e| panic!("{word} is not an index: {e}"))
}

/// Parts of a text between commas.
fn list<'t, 'a>(text: &'t [Tree<'a>]) -> Vec<&'t [Tree<'a>]> {
    if text.is_empty() {
        return Vec::new();
    }
    text.split(|tree| matches!(tree, Word(","))).collect()
}

/// `a`, `(a, b)`
fn names<'a>(text: &[Tree<'a>]) -> Vec<&'a str> {
    let name = |text: &[Tree<'a>]| match text {
        [Word(name)] => *name,
        other => panic!("unexpected name {other:?}"),
    };
    match text {
        [Round(all)] => list(all).into_iter().map(name).collect(),
        one => vec![name(one)],
    }
}

//! `default`: classes of attributes, each of which takes over those of the class around it.

use std::collections::HashMap;

use super::element::{attribute, Element};
use crate::import::source::Spanned;
use crate::import::words::{did_you_mean, list, quote};
use crate::import::xml::{place, Reader};
use roxmltree::Node;

/// The class that holds where no other does, the outermost one.
pub(super) const MAIN: usize = 0;

/// Levels of classes inside each other.
const DEEPEST: usize = 100;

/// All classes of a file.
pub(super) struct Classes<'d> {
    list: Vec<Class<'d>>,
    index: HashMap<&'d str, usize>,
}

struct Class<'d> {
    around: Option<usize>,
    elements: Vec<Node<'d, 'd>>,
}

impl<'d> Classes<'d> {
    /// Reads the outermost `default` elements.
    pub fn read(reader: &mut Reader, outermost: &[Node<'d, 'd>]) -> Self {
        let main = Class { around: None, elements: Vec::new() };
        let mut classes = Classes { list: vec![main], index: HashMap::from([("main", MAIN)]) };
        for node in outermost {
            if let Some(name) = attribute(*node, "class") {
                classes.index.insert(name.value, MAIN);
            }
            let mut stack = vec![(*node, MAIN, 0)];
            while let Some((node, class, depth)) = stack.pop() {
                let mut inner = Vec::new();
                for child in node.children().filter(Node::is_element) {
                    if child.tag_name().name() != "default" {
                        classes.list[class].elements.push(child);
                    } else if depth == DEEPEST {
                        let message = format!("more than {DEEPEST} classes inside each other");
                        reader.findings.error(place(child), message, "write fewer levels of `default`");
                    } else if let Some(k) = classes.add(reader, child, class) {
                        inner.push((child, k, depth + 1));
                    }
                }
                stack.extend(inner.into_iter().rev());
            }
        }
        classes
    }

    fn add(&mut self, reader: &mut Reader, node: Node<'d, 'd>, around: usize) -> Option<usize> {
        let name = reader.required(node, "class", "")?;
        let name = Spanned::new(attribute(node, "class")?.value, name.span);
        let k = self.list.len();
        if self.index.contains_key(name.value) {
            let message = format!("class {} is defined twice", quote(name.value));
            reader.findings.error(name.span, message, "rename one of them");
            return None;
        }
        self.index.insert(name.value, k);
        self.list.push(Class { around: Some(around), elements: Vec::new() });
        Some(k)
    }

    /// The class that an attribute names; `None` without the attribute, or where the name was reported.
    pub fn named(&self, reader: &mut Reader, node: Node<'d, 'd>, key: &str) -> Option<usize> {
        let name = attribute(node, key)?;
        let found = self.index.get(name.value).copied();
        if found.is_none() {
            let mut names: Vec<&str> = self.index.keys().copied().collect();
            names.sort_unstable();
            let help = did_you_mean(name.value, names.iter().copied(), || {
                format!("the classes are {}", list(names.iter().copied()))
            });
            reader.findings.error(name.span, format!("{} is not a class of defaults", quote(name.value)), help);
        }
        found
    }

    /// An element with its defaults: those for the elements called `tags` in its own class, or else in `class`.
    pub fn resolve(&self, reader: &mut Reader, node: Node<'d, 'd>, tags: &[&str], class: usize) -> Element<'d> {
        let mut class = Some(self.named(reader, node, "class").unwrap_or(class));
        let mut defaults = Vec::new();
        while let Some(k) = class {
            let of_class = &self.list[k];
            let wanted = |node: &&Node| tags.contains(&node.tag_name().name());
            defaults.extend(of_class.elements.iter().rev().filter(wanted).copied());
            class = of_class.around;
        }
        Element::new(node, defaults)
    }
}

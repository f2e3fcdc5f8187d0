//! The tree: parents, children, order, cycles.

use super::names::Names;
use crate::import::raw::RawModel;
use crate::import::source::Findings;
use crate::import::words::{list, quote};

/// Ends of a joint by index; `None` where there is no such body (reported).
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// Parent, the inner `None` being the ground.
    pub(super) parent: Option<Option<usize>>,
    /// Child.
    pub(super) child: Option<usize>,
}

/// Resolves the ends of all joints.
pub(super) fn links(raw: &RawModel, names: &Names, findings: &mut Findings) -> Vec<Link> {
    let mut links = Vec::new();
    for j in &raw.joints {
        let what = format!("joint {}", quote(&j.name.value));
        let parent = match &j.parent {
            None => Some(None),
            Some(name) => names.body(name, "parent ", &what, findings),
        };
        let child = j.child.as_ref().and_then(|name| match names.body(name, "child ", &what, findings) {
            Some(None) => {
                let help = "the ground carries and is not carried: make it the parent";
                findings.error(name.span, format!("{what}: the ground cannot be the child"), help);
                None
            }
            other => other.flatten(),
        });
        links.push(Link { parent, child });
    }
    links
}

/// Joint indices depth first from the ground, children in file order; `None` if the joints form no tree over all
/// bodies.
pub(super) fn order(raw: &RawModel, names: &Names, links: &[Link], findings: &mut Findings) -> Option<Vec<usize>> {
    let carrier = carriers(raw, names, links, findings);
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); raw.bodies.len() + 1];
    for (j, link) in links.iter().enumerate() {
        if let (Some(parent), Some(child)) = (link.parent, link.child) {
            // A second joint of a body was reported; following it would visit the body twice.
            if carrier[child] == Some(j) {
                children[parent.map_or(raw.bodies.len(), |b| b)].push(j);
            }
        }
    }
    let mut order = Vec::new();
    let mut reached = vec![false; raw.bodies.len()];
    let mut stack: Vec<usize> = children[raw.bodies.len()].iter().rev().copied().collect();
    while let Some(j) = stack.pop() {
        order.push(j);
        if let Some(child) = links[j].child {
            reached[child] = true;
            stack.extend(children[child].iter().rev());
        }
    }
    cycles(raw, links, &carrier, &reached, findings);
    (order.len() == raw.joints.len() && reached.iter().all(|r| *r)).then_some(order)
}

/// The joint of each body; reports bodies with none or two.
fn carriers(raw: &RawModel, names: &Names, links: &[Link], findings: &mut Findings) -> Vec<Option<usize>> {
    let mut carrier: Vec<Option<usize>> = vec![None; raw.bodies.len()];
    for (j, link) in links.iter().enumerate() {
        let (Some(child), Some(name)) = (link.child, &raw.joints[j].child) else { continue };
        match carrier[child] {
            None => carrier[child] = Some(j),
            Some(first) => {
                let message = format!(
                    "joint {}: child {} is already carried by joint {}",
                    quote(&raw.joints[j].name.value),
                    quote(&name.value),
                    quote(&raw.joints[first].name.value)
                );
                let help = match raw.lenient {
                    true => "a body hangs on one joint: remove one of the two; closed loops need a TOML model, which has `[[loop]]`",
                    false => "a body hangs on one joint: remove one of the two; to close a loop make it a `[[loop]]`",
                };
                findings.error(name.span, message, help);
            }
        }
    }
    for (b, body) in raw.bodies.iter().enumerate() {
        // The second of two bodies of one name is reported as that.
        if carrier[b].is_none() && !raw.incomplete && names.is_first(b) {
            let name = &body.name.value;
            let help = format!(
                "add a joint with {} as its child; a body that moves freely has a `floating` joint to `ground`",
                quote(name)
            );
            findings.error(body.name.span, format!("body {} is not the child of any joint", quote(name)), help);
        }
    }
    carrier
}

/// Reports each ring of joints once. Bodies that hang on a ring, or on something reported, are not reported again.
fn cycles(raw: &RawModel, links: &[Link], carrier: &[Option<usize>], reached: &[bool], findings: &mut Findings) {
    // 0: not visited; k: visited by the walk that started at body k - 1.
    let mut walk = vec![0; raw.bodies.len()];
    for start in 0..raw.bodies.len() {
        let mut body = start;
        while !reached[body] && walk[body] == 0 {
            walk[body] = start + 1;
            let above = carrier[body].and_then(|j| links[j].parent);
            match above {
                Some(Some(parent)) => body = parent,
                _ => break,
            }
            if walk[body] == start + 1 {
                report_cycle(raw, links, carrier, body, findings);
                break;
            }
        }
    }
}

fn report_cycle(raw: &RawModel, links: &[Link], carrier: &[Option<usize>], body: usize, findings: &mut Findings) {
    let mut ring = Vec::new();
    let mut at = body;
    loop {
        let Some(j) = carrier[at] else { return };
        ring.push(j);
        match links[j].parent {
            Some(Some(parent)) => at = parent,
            _ => return,
        }
        if at == body {
            break;
        }
    }
    ring.sort_unstable();
    let first = &raw.joints[ring[0]];
    let span = first.parent.as_ref().map_or(first.name.span, |p| p.span);
    if ring.len() == 1 {
        let message = format!("joint {}: parent and child are the same body", quote(&first.name.value));
        findings.error(span, message, "name the body (or `ground`) it hangs on as its parent");
    } else {
        let names = list(ring.iter().map(|&j| raw.joints[j].name.value.as_str()));
        let message = format!("joints {names} form a cycle that never reaches the ground");
        findings.error(
            span,
            message,
            "let one of them have `ground`, or a body that is connected to it, as its parent",
        );
    }
}

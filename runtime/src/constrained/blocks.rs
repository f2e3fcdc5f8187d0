//! `Φ` by groups of rows that share velocities: many small loops are many small matrices.

use alloc::vec;
use alloc::vec::Vec;

use crate::system::{Constrained, Real};

/// A group of rows and the velocities they bind, with their part of `Φ`.
#[derive(Clone, Debug)]
pub(super) struct Block<S> {
    pub rows: Vec<usize>,
    pub columns: Vec<usize>,
    /// `rows × columns`.
    pub a: Vec<S>,
}

/// All groups.
#[derive(Clone, Debug)]
pub(super) struct Blocks<S> {
    pub list: Vec<Block<S>>,
    /// For each entry of `Φ`: its block and its place there.
    places: Vec<(usize, usize)>,
}

impl<S: Real> Blocks<S> {
    pub fn new<Y: Constrained<Scalar = S>>(system: &Y) -> Self {
        let (rows, columns) = (system.rows(), system.entry_columns());
        let nv = columns.iter().fold(0, |n, c| n.max(c + 1));
        // Which row binds a velocity first; rows that meet there belong together.
        let mut parent: Vec<usize> = (0..rows.len()).collect();
        let mut owner = vec![usize::MAX; nv];
        for (r, row) in rows.iter().enumerate() {
            for &column in &columns[row.first..row.first + row.len] {
                if owner[column] == usize::MAX {
                    owner[column] = r;
                } else {
                    let (a, b) = (root(&mut parent, owner[column]), root(&mut parent, r));
                    parent[a.max(b)] = a.min(b);
                }
            }
        }
        let mut number = vec![usize::MAX; rows.len()];
        let mut list: Vec<Block<S>> = Vec::new();
        let mut block_of = vec![0; rows.len()];
        for r in 0..rows.len() {
            let top = root(&mut parent, r);
            if number[top] == usize::MAX {
                number[top] = list.len();
                list.push(Block { rows: Vec::new(), columns: Vec::new(), a: Vec::new() });
            }
            block_of[r] = number[top];
            list[number[top]].rows.push(r);
        }
        let mut local = vec![usize::MAX; nv];
        for (column, owner) in owner.iter().enumerate().filter(|(_, owner)| **owner != usize::MAX) {
            let block = &mut list[block_of[*owner]];
            local[column] = block.columns.len();
            block.columns.push(column);
        }
        let mut places = vec![(0, 0); columns.len()];
        let mut seen = vec![0; list.len()];
        for (r, row) in rows.iter().enumerate() {
            let block = block_of[r];
            for e in row.first..row.first + row.len {
                places[e] = (block, seen[block] * list[block].columns.len() + local[columns[e]]);
            }
            seen[block] += 1;
        }
        for block in &mut list {
            block.a = vec![S::zero(); block.rows.len() * block.columns.len()];
        }
        Blocks { list, places }
    }

    /// Takes the entries of `Φ`.
    pub fn fill(&mut self, entries: &[S]) {
        for block in &mut self.list {
            block.a.fill(S::zero());
        }
        for (entry, (block, at)) in entries.iter().zip(&self.places) {
            let a = &mut self.list[*block].a;
            a[*at] = a[*at] + *entry;
        }
    }

    /// Leaves out rows.
    pub fn release(&mut self, rows: &[bool]) {
        for block in &mut self.list {
            for (row, a) in block.rows.iter().zip(block.a.chunks_mut(block.columns.len().max(1))) {
                if rows[*row] {
                    a.fill(S::zero());
                }
            }
        }
    }

    /// Leaves out velocities that are held.
    pub fn hold(&mut self, held: &[bool]) {
        for block in &mut self.list {
            let n = block.columns.len();
            for (j, column) in block.columns.iter().enumerate() {
                if held.get(*column).copied().unwrap_or(false) {
                    block.a.iter_mut().skip(j).step_by(n).for_each(|x| *x = S::zero());
                }
            }
        }
    }
}

fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

//! Entries of tables, which height fields have.

/// An entry of a table; see [`Scalar::look_up`](mbd_runtime::Scalar::look_up).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LookUp {
    /// The node whose value is the number of the entry.
    pub at: u32,
    /// Whether it is that of the negative of this value.
    pub minus: bool,
    /// The table.
    pub table: Table,
    /// What is added to the number.
    pub offset: u32,
}

/// A table of numbers. Tables are equal where they are the same one.
#[derive(Clone, Copy)]
pub struct Table(pub &'static [f64]);

impl PartialEq for Table {
    fn eq(&self, other: &Table) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl Eq for Table {}

impl std::hash::Hash for Table {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        state.write_usize(self.0.as_ptr() as usize);
    }
}

impl std::fmt::Debug for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "table of {} numbers", self.0.len())
    }
}

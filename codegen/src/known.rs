//! What was made once and stays for as long as the program runs.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Mutex, PoisonError};

/// Things by what they were made of: equal ones exist once.
pub(crate) struct Known<K, V>(Mutex<Option<HashMap<K, V>>>);

impl<K: Eq + Hash, V: Copy> Known<K, V> {
    /// Nothing is known yet.
    pub(crate) const fn new() -> Self {
        Known(Mutex::new(None))
    }

    /// The one that is made of `key`.
    pub(crate) fn get(&self, key: K, make: impl FnOnce() -> V) -> V {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *all.get_or_insert_with(HashMap::new).entry(key).or_insert_with(make)
    }
}

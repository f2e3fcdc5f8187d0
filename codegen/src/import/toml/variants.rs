//! `[[variant]]`.

use super::super::raw::{RawModel, RawVariant};
use super::super::source::{Findings, Spanned};
use super::base::Known;
use super::table::Table;
use super::Named;

pub(super) const VARIANT: &[&str] =
    &["name", "remove", "cut", "lock", "body", "joint", "frame", "wrench", "loop", "coupling", "shape", "contact"];

/// All variants, in the order of the file.
pub(super) fn all(top: &Table, named: &Named, raw: &mut RawModel, findings: &mut Findings) {
    for table in top.tables("variant", findings) {
        let variant = variant(&table, named, raw, findings);
        raw.variants.extend(variant);
    }
}

fn variant(table: &Table, named: &Named, raw: &RawModel, findings: &mut Findings) -> Option<RawVariant> {
    table.reject_unknown(VARIANT, "a variant", findings);
    let name = table.required_text("name", findings);
    let mut names = |key: &str, example: &str| -> Vec<Spanned<String>> {
        table.texts(key, example, findings).map_or(Vec::new(), |list| list.value)
    };
    let remove = names("remove", "`remove = [\"body\"]`, names of bodies");
    let cut = names("cut", "`cut = [\"joint\"]`, names of joints, loops, couplings or contacts");
    let lock = names("lock", "`lock = [\"joint\"]`, names of joints");
    let mut added = RawModel::empty();
    super::parts(table, named, &raw.joints, &mut Known::default(), &mut added, findings);
    Some(RawVariant { name: name?, remove, cut, lock, added })
}

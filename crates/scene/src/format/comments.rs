//! Order of the tables in scene files, and comments above removed tables. An empty line below a
//! comment means that the comment belongs to the file, not to the table below it.

use crate::value::sort_by_number;
use toml_edit::{DocumentMut, Item, Table};

/// Comments that stand above removed tables but belong to the file, and therefore stay.
#[derive(Default)]
pub(crate) struct CommentKeeper {
    /// Position of the removed table below each comment, and the text of the comment.
    comments: Vec<(isize, String)>,
}

impl CommentKeeper {
    /// Records the comments that stay when `item`, with all tables in it, is removed.
    pub(crate) fn removed(&mut self, item: &Item) {
        match item {
            Item::Table(table) => {
                let separate = split(prefix(table)).0;
                if let Some(position) = table.position().filter(|_| separate.contains('#')) {
                    self.comments.push((position, separate.to_string()));
                }
                for (_, inner) in table.iter() {
                    self.removed(inner);
                }
            }
            Item::ArrayOfTables(list) => {
                for table in list {
                    self.removed(&Item::Table(table.clone()));
                }
            }
            _ => {}
        }
    }

    /// Restores each comment above the first remaining table that comes after the removed one, or
    /// at the end of the file.
    pub(crate) fn put_back(self, document: &mut DocumentMut) {
        let mut comments = self.comments;
        sort_by_number(&mut comments, |(position, _)| -*position as i64);
        let mut positions = Vec::new();
        for_each_table(document.as_table_mut(), &mut |table| positions.extend(table.position()));
        for (position, comment) in comments {
            let Some(after) = positions.iter().copied().filter(|p| *p > position).min() else {
                let end = document.trailing().as_str().unwrap_or_default();
                let comment = comment.trim_end_matches('\n');
                document.set_trailing(format!("{comment}\n{end}"));
                continue;
            };
            for_each_table(document.as_table_mut(), &mut |table| {
                if table.position() == Some(after) {
                    put_above(table, &comment);
                }
            });
        }
    }
}

/// Calls `act` for every table inside `table` that has a header in the file.
fn for_each_table(table: &mut Table, act: &mut dyn FnMut(&mut Table)) {
    for (_, item) in table.iter_mut() {
        match item {
            Item::Table(inner) => {
                if !inner.is_dotted() && !inner.is_implicit() {
                    act(inner);
                }
                for_each_table(inner, act);
            }
            Item::ArrayOfTables(list) => {
                for inner in list.iter_mut() {
                    act(inner);
                    for_each_table(inner, act);
                }
            }
            _ => {}
        }
    }
}

fn prefix(table: &Table) -> &str {
    table.decor().prefix().and_then(|p| p.as_str()).unwrap_or_default()
}

/// Splits the text above a table into the comments of the file and the comments of the table.
fn split(above: &str) -> (&str, &str) {
    let mut cut = 0;
    let mut end = 0;
    for line in above.split_inclusive('\n') {
        end += line.len();
        if line.trim().is_empty() {
            cut = end;
        }
    }
    above.split_at(cut)
}

fn put_above(table: &mut Table, comment: &str) {
    let table_comment = prefix(table);
    let table_comment = table_comment.strip_prefix('\n').unwrap_or(table_comment);
    let joined = format!("{comment}{table_comment}");
    table.decor_mut().set_prefix(joined);
}

/// Sets the positions of `tables` so that the file has them in the order of the slice. `from` has
/// the index of each table before the edit, `None` for a new table. Nothing changes if the old
/// order is kept and new tables come last.
pub(crate) fn in_order(tables: &mut [Table], from: &[Option<usize>]) {
    let old: Vec<usize> = from.iter().flatten().copied().collect();
    let tail_only = from.iter().skip_while(|i| i.is_some()).all(Option::is_none);
    if tail_only && old.is_sorted() {
        return;
    }
    let first = tables.iter().filter_map(Table::position).min();
    let Some(top) = tables.iter().position(|t| t.position() == first && first.is_some()) else {
        return;
    };
    // A comment of the file above the first table stays at the top.
    let (separate, table_comment) = split(prefix(&tables[top]));
    let (separate, table_comment) = (separate.to_string(), table_comment.to_string());
    if top > 0 && separate.contains('#') {
        tables[top].decor_mut().set_prefix(format!("\n{table_comment}"));
        put_above(&mut tables[0], &separate);
    }
    for table in tables.iter_mut() {
        forget_place(table);
    }
    tables[0].set_position(first);
}

/// Removes the positions of `table` and its inner tables, which are then written after the previous
/// table.
fn forget_place(table: &mut Table) {
    table.set_position(None);
    for_each_table(table, &mut |inner| inner.set_position(None));
}

//! Comments that belong to the file rather than to the table below them, and the order of tables.

use toml_edit::{DocumentMut, Item, Table};

/// Keeps comments of removed tables that an empty line separates from the table.
#[derive(Default)]
pub(crate) struct CommentKeeper {
    /// Position of the removed table, and the comment.
    comments: Vec<(isize, String)>,
}

impl CommentKeeper {
    /// Records the separate comments above the tables of a removed item.
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

    /// Restores the comments above the next remaining table, or at the end of the file.
    pub(crate) fn put_back(self, document: &mut DocumentMut) {
        let mut comments = self.comments;
        comments.sort_by_key(|(position, _)| -position);
        for (position, comment) in comments {
            let mut after: Option<isize> = None;
            for_each_table(document.as_table_mut(), &mut |table| {
                if let Some(p) = table.position().filter(|p| *p > position) {
                    after = Some(after.map_or(p, |a| a.min(p)));
                }
            });
            match after {
                Some(after) => for_each_table(document.as_table_mut(), &mut |table| {
                    if table.position() == Some(after) {
                        put_above(table, &comment);
                    }
                }),
                None => {
                    let end = document.trailing().as_str().unwrap_or_default();
                    document.set_trailing(format!(
                        "{}{end}",
                        comment.trim_end_matches('\n').to_owned() + "\n"
                    ));
                }
            }
        }
    }
}

/// Calls `act` for every table with a header and a position in the file.
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

/// Splits the text above a table after its last empty line: the separate comment, and that of the
/// table.
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

/// Gives `tables`, which come from the old entries `from` or are new, positions in the file that
/// follow their order. Nothing changes if the old ones kept their order and the new ones come last.
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
    // The comment that opens the file stays on top.
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

/// Removes the position of a table, which then follows the one before it.
fn forget_place(table: &mut Table) {
    table.set_position(None);
    for_each_table(table, &mut |inner| inner.set_position(None));
}

//! Access to the values of a description by key path, such as `shape.sphere.radius`.

use crate::value::Validator;
use std::collections::BTreeMap;

/// Key whose value determines [`KeyNode::base`].
pub(crate) const PRESET: &str = "preset";

/// Value of a key as edits read and write it.
#[derive(Clone, Debug, PartialEq)]
pub enum KeyValue {
    /// One number, or the numbers of a list or a colour.
    Numbers(Vec<f64>),
    /// Switch: `true` or `false`.
    Switch(bool),
    /// String, word of a choice, or kind of a value that has one of several kinds.
    Text(String),
}

impl KeyValue {
    /// Returns the value as `N` numbers, if it has this type.
    pub(crate) fn numbers<const N: usize>(self) -> Option<[f64; N]> {
        if let Self::Numbers(list) = self { list.try_into().ok() } else { None }
    }

    /// Returns the value as `N` whole numbers, if it has this type.
    pub(crate) fn wholes<const N: usize>(self) -> Option<[u32; N]> {
        let list: [f64; N] = self.numbers()?;
        let wholes = list.map(|x| x as u32);
        (wholes.map(f64::from) == list).then_some(wholes)
    }

    /// Returns the value as a switch, if it is one.
    pub(crate) fn switch(self) -> Option<bool> {
        if let Self::Switch(on) = self { Some(on) } else { None }
    }

    /// Returns the value as text, if it is one.
    pub(crate) fn text(self) -> Option<String> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }
}

/// Node of a description: a table, an entry of a list, or a single value.
pub trait KeyNode {
    /// Returns the value of the node; `None` for tables and absent values.
    fn value(&self) -> Option<KeyValue> {
        None
    }

    /// Sets the value, without a check of ranges. Returns `true` if the node can have it.
    fn set_value(&mut self, _: KeyValue) -> bool {
        false
    }

    /// Returns `true` if the value stands for an omitted key.
    fn is_absent(&self) -> bool {
        false
    }

    /// Removes the value of an optional key, which then counts as omitted. Has no effect on other
    /// values.
    fn make_absent(&mut self) {}

    /// Returns the child `key`, if any: a key of a table, the kind of a value, or an index from 0.
    fn child(&self, _key: &str) -> Option<&dyn KeyNode> {
        None
    }

    /// Returns [`KeyNode::child`] as a mutable reference.
    fn child_mut(&mut self, _key: &str) -> Option<&mut dyn KeyNode> {
        None
    }

    /// Returns the child node `key` as a mutable reference. If it does not exist, it is created:
    /// the kind `key`, a new entry at the end of a list, or a table with this name.
    fn make_child(&mut self, key: &str) -> Option<&mut dyn KeyNode> {
        self.child_mut(key)
    }

    /// Returns a table with the values that omitted keys have by the key `preset`; `None` if they
    /// have their declared defaults.
    fn base(&self) -> Option<Box<dyn KeyNode>> {
        None
    }

    /// Gives all keys the values of [`KeyNode::base`], if there is one.
    fn rebase(&mut self) {}

    /// Returns a validator that has checked each value of a table against the range of its key.
    fn validator(&self) -> Validator {
        Validator::new(&[])
    }

    /// Returns the names of the tables in a map of named tables; nothing for other nodes.
    fn names(&self) -> Vec<&str> {
        Vec::new()
    }
}

/// Node of an optional value; `None` is absent.
impl<T: KeyNode + Default> KeyNode for Option<T> {
    fn value(&self) -> Option<KeyValue> {
        self.as_ref()?.value()
    }

    fn set_value(&mut self, value: KeyValue) -> bool {
        let mut new = T::default();
        let is_set = new.set_value(value);
        if is_set {
            *self = Some(new);
        }
        is_set
    }

    fn is_absent(&self) -> bool {
        self.is_none()
    }

    fn make_absent(&mut self) {
        *self = None;
    }

    fn child(&self, key: &str) -> Option<&dyn KeyNode> {
        self.as_ref()?.child(key)
    }

    fn child_mut(&mut self, key: &str) -> Option<&mut dyn KeyNode> {
        self.as_mut()?.child_mut(key)
    }

    fn make_child(&mut self, key: &str) -> Option<&mut dyn KeyNode> {
        self.get_or_insert_default().make_child(key)
    }
}

/// Node of a list of tables; its children have indices as keys.
impl<T: KeyNode + Default> KeyNode for Vec<T> {
    fn is_absent(&self) -> bool {
        self.is_empty()
    }

    fn make_absent(&mut self) {
        self.clear();
    }

    fn child(&self, index: &str) -> Option<&dyn KeyNode> {
        Some(self.get(index.parse::<usize>().ok()?)?)
    }

    fn child_mut(&mut self, index: &str) -> Option<&mut dyn KeyNode> {
        Some(self.get_mut(index.parse::<usize>().ok()?)?)
    }

    fn make_child(&mut self, index: &str) -> Option<&mut dyn KeyNode> {
        if index.parse::<usize>().ok()? < self.len() {
            return self.child_mut(index);
        }
        self.push(T::default());
        Some(self.last_mut()?)
    }
}

/// Node of named tables; its children have their names as keys.
impl<T: KeyNode + Default> KeyNode for BTreeMap<String, T> {
    fn child(&self, name: &str) -> Option<&dyn KeyNode> {
        Some(self.get(name)?)
    }

    fn child_mut(&mut self, name: &str) -> Option<&mut dyn KeyNode> {
        Some(self.get_mut(name)?)
    }

    fn make_child(&mut self, name: &str) -> Option<&mut dyn KeyNode> {
        Some(self.entry(name.to_string()).or_default())
    }

    fn names(&self) -> Vec<&str> {
        self.keys().map(String::as_str).collect()
    }
}

/// Returns the node at the dotted `path` below `root`; `None` if there is none.
pub fn node_at<'a>(root: &'a dyn KeyNode, path: &str) -> Option<&'a dyn KeyNode> {
    path.split('.').try_fold(root, |node, key| node.child(key))
}

/// Returns [`node_at`] as a mutable reference.
pub fn node_at_mut<'a>(root: &'a mut dyn KeyNode, path: &str) -> Option<&'a mut dyn KeyNode> {
    path.split('.').try_fold(root, |node, key| node.child_mut(key))
}

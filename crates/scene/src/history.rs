//! Undo and redo of whole scenes, and coalescing of successive edits into one undo step.

use crate::camera::Camera;
use crate::light::{Light, LightGroup};
use crate::material::Material;
use crate::{Object, Scene};
use std::collections::VecDeque;
use std::sync::Arc;

/// Largest estimated memory of all scenes to which undo can return [bytes].
const MAX_BYTES: usize = 64 << 20;
/// Largest number of edits that can be undone.
const MAX_STEPS: usize = 10_000;

/// Undo history of an editor. Edits with the same label during a gesture (a drag, a mode, or the
/// repeats of a held key) are coalesced into one step.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Scenes to which undo returns, the oldest first.
    past: VecDeque<HistoryEntry>,
    now: Arc<Scene>,
    /// Scenes to which redo returns; the last entry comes next.
    future: Vec<HistoryEntry>,
    /// `true` during a gesture: the next edit may be coalesced with the last step.
    open: bool,
    saved: Arc<Scene>,
}

/// Scene before or after a step, and the label of the step.
#[derive(Clone, Debug)]
struct HistoryEntry {
    scene: Arc<Scene>,
    label: String,
}

impl History {
    /// Creates an undo history without steps. `scene` is the current and the saved scene.
    pub fn new(scene: Arc<Scene>) -> Self {
        let saved = Arc::clone(&scene);
        Self { past: VecDeque::new(), now: scene, future: Vec::new(), open: false, saved }
    }

    /// Returns the current scene: the result of all edits that have not been undone.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.now
    }

    /// Makes `scene` the current scene. Successive calls with `held` and the same label, as during
    /// a gesture, make one undo step. Returns `true` if the scene has changed; if it has not,
    /// nothing is recorded.
    pub fn record(&mut self, scene: Arc<Scene>, label: &str, held: bool) -> bool {
        if *scene == *self.now {
            return false;
        }
        self.future.clear();
        let grows = held && self.open && self.past.back().is_some_and(|last| last.label == label);
        let before = std::mem::replace(&mut self.now, scene);
        self.open = held;
        if grows {
            // A gesture that returns to the scene from which it started leaves no step.
            if self.past.back().is_some_and(|last| *last.scene == *self.now) {
                self.now = self.past.pop_back().map_or(before, |last| last.scene);
                self.open = false;
            }
        } else {
            self.past.push_back(HistoryEntry { scene: before, label: label.to_string() });
            self.forget();
        }
        true
    }

    /// Ends a gesture.
    pub fn end_gesture(&mut self) {
        self.open = false;
    }

    /// Undoes the last step of the history and returns its label; `None` if no step can be undone.
    pub fn undo(&mut self) -> Option<String> {
        self.open = false;
        let HistoryEntry { scene, label } = self.past.pop_back()?;
        let after = std::mem::replace(&mut self.now, scene);
        self.future.push(HistoryEntry { scene: after, label: label.clone() });
        Some(label)
    }

    /// Redoes the step undone last and returns its label; `None` if no step can be redone.
    pub fn redo(&mut self) -> Option<String> {
        self.open = false;
        let HistoryEntry { scene, label } = self.future.pop()?;
        let before = std::mem::replace(&mut self.now, scene);
        self.past.push_back(HistoryEntry { scene: before, label: label.clone() });
        Some(label)
    }

    /// Returns the labels of the steps that can be undone, the oldest first, and of those that can
    /// be redone, the next first.
    pub fn labels(&self) -> (Vec<&str>, Vec<&str>) {
        let past = self.past.iter().map(|entry| entry.label.as_str());
        let future = self.future.iter().rev().map(|entry| entry.label.as_str());
        (past.collect(), future.collect())
    }

    /// Records that `scene`, the current or an earlier one, has been written to the file.
    pub fn mark_saved(&mut self, scene: Arc<Scene>) {
        self.saved = scene;
        self.open = false;
    }

    /// Returns `true` if the current scene equals the saved one.
    pub fn is_saved(&self) -> bool {
        Arc::ptr_eq(&self.saved, &self.now) || *self.saved == *self.now
    }

    /// Drops all steps of the undo history and makes `scene` the current and the saved scene.
    pub fn restart(&mut self, scene: Arc<Scene>) {
        *self = Self::new(scene);
    }

    /// Drops the oldest steps beyond the limits. The latest step is kept.
    fn forget(&mut self) {
        let mut total: usize = self.past.iter().map(|entry| bytes(&entry.scene)).sum();
        while self.past.len() > 1 && (total > MAX_BYTES || self.past.len() > MAX_STEPS) {
            total -= self.past.pop_front().map_or(0, |entry| bytes(&entry.scene));
        }
    }
}

/// Returns the estimated memory of a scene in bytes. Name, material name and transform of an object
/// count as 128, other names as 16 or 32.
fn bytes(scene: &Scene) -> usize {
    size_of::<Scene>()
        + scene.objects.len() * (size_of::<Object>() + 128)
        + scene.lights.len() * (size_of::<Light>() + 16)
        + scene.materials.len() * (size_of::<Material>() + 32)
        + scene.groups.len() * (size_of::<LightGroup>() + 32)
        + scene.cameras.len() * (size_of::<Camera>() + 32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(depth: u32) -> Arc<Scene> {
        let mut scene = Scene::default();
        scene.trace.max_depth = depth;
        Arc::new(scene)
    }

    fn depth(history: &History) -> u32 {
        history.scene().trace.max_depth
    }

    #[test]
    fn undo_and_redo_restore_scenes() {
        let mut history = History::new(scene(0));
        assert!(history.is_saved() && history.undo().is_none() && history.redo().is_none());
        assert!(history.record(scene(1), "one", false));
        assert!(history.record(scene(2), "two", false));
        assert!(!history.record(scene(2), "nothing", false));
        assert!(history.redo().is_none());
        assert_eq!(history.undo().as_deref(), Some("two"));
        assert_eq!(depth(&history), 1);
        assert_eq!(history.redo().as_deref(), Some("two"));
        assert_eq!(depth(&history), 2);
        history.undo();
        history.undo();
        assert!(depth(&history) == 0 && history.is_saved());
        history.record(scene(3), "three", false);
        assert!(history.redo().is_none(), "another way was taken");
    }

    #[test]
    fn steps_of_a_gesture_are_coalesced() {
        let mut history = History::new(scene(0));
        for i in 1..50 {
            history.record(scene(i), "drag", true);
        }
        history.record(scene(60), "other", true);
        history.record(scene(61), "other", true);
        history.end_gesture();
        history.record(scene(62), "other", true);
        let back: Vec<_> = std::iter::from_fn(|| {
            history.undo()?;
            Some(depth(&history))
        })
        .collect();
        assert_eq!(back, [61, 49, 0]);
        history.record(scene(7), "drag", true);
        history.record(scene(0), "drag", true);
        assert!(history.undo().is_none(), "back where it began");
        assert_eq!(depth(&history), 0);
    }

    #[test]
    fn is_saved_compares_scenes_not_steps() {
        let mut history = History::new(scene(0));
        history.record(scene(1), "one", true);
        history.mark_saved(Arc::clone(history.scene()));
        history.record(scene(2), "one", true);
        assert!(!history.is_saved());
        history.record(scene(1), "back", false);
        assert!(history.is_saved());
        assert_eq!(history.undo().as_deref(), Some("back"), "a saved step has ended");
        history.restart(scene(9));
        assert!(history.is_saved() && history.undo().is_none());
    }

    #[test]
    fn history_memory_is_bounded() {
        let mut large = (*scene(0)).clone();
        let text = "object = [{ shape.sphere = { center = [0, 0, 0], radius = 1 } }]";
        let ball = Scene::parse(text, "").unwrap().objects.remove(0);
        large.objects = vec![ball; 20_000];
        let mut history = History::new(Arc::new(large.clone()));
        for depth in 1..100 {
            large.trace.max_depth = depth;
            history.record(Arc::new(large.clone()), "deeper", false);
        }
        let held: usize = history.past.iter().map(|entry| bytes(&entry.scene)).sum();
        assert!(held <= MAX_BYTES && history.past.len() > 3, "{held}");
        assert!(history.past.len() < 99);
    }
}

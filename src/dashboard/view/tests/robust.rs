//! Tests that drawing neither panics nor emits control characters, in any state, size and colour
//! depth.

use crate::dashboard::model::Colors;
use crate::dashboard::view::tests::drawn;
use crate::dashboard::view::tests::states::{Named, STATES, tracing};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(250))]
    #[test]
    fn every_state_draws_without_control_characters(
        width in 0u16..=300, height in 0u16..=100, state in 0..STATES.len(), colors in 0usize..4,
    ) {
        let mut model = tracing([width, height]);
        STATES[state].1(&mut model);
        model.colors = Colors::ALL[colors];
        let (buffer, cursor) = drawn(&model);
        for cell in buffer.content() {
            prop_assert!(!cell.symbol().chars().any(char::is_control));
        }
        if let Some(at) = cursor {
            prop_assert!(at.x < width && at.y < height, "cursor at {at:?}");
        }
    }
}

/// Checks that every state of the model can be drawn at small screen sizes, and at widths close to
/// those at which the layout changes.
#[test]
fn every_state_draws_at_threshold_sizes() {
    let draw = |states: &[Named]| {
        for (_, make) in states {
            for width in (0..46).chain([71, 72, 73, 99, 100]) {
                for height in (width % 5..20).step_by(5) {
                    let mut model = tracing([width, height]);
                    make(&mut model);
                    drawn(&model);
                }
            }
        }
    };
    // Two threads share the work, because this is the longest test of drawing.
    let (left, right) = STATES.split_at(STATES.len() / 2);
    std::thread::scope(|scope| {
        scope.spawn(|| draw(left));
        draw(right);
    });
}

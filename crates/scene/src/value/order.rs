//! Stable sorting of numbers with little machine code. The sorting functions of the standard
//! library are compiled for each type of items, into 8 KB each.

/// Sorts `items` by ascending keys. Items with equal keys keep their order.
pub fn sort_by_number<T>(items: &mut Vec<T>, key: impl Fn(&T) -> i64) {
    let order = ascending(items.iter().map(key).collect());
    let mut unsorted: Vec<Option<T>> = items.drain(..).map(Some).collect();
    items.extend(order.into_iter().filter_map(|i| unsorted[i].take()));
}

/// Returns the indices of `keys`, sorted by ascending key and, for equal keys, by index.
pub fn ascending(keys: Vec<i64>) -> Vec<usize> {
    let mut order: Vec<(i64, usize)> = keys.into_iter().zip(0..).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}

/// Converts `x` to an integer with the order of [`f64::total_cmp`].
pub fn total_order(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    // The bits of negative numbers ascend with the absolute value.
    bits ^ ((bits >> 63) as u64 >> 1) as i64
}

/// Returns the number that [`total_order`] has converted to `x`.
pub fn from_total_order(x: i64) -> f64 {
    f64::from_bits(total_order(f64::from_bits(x as u64)) as u64)
}

#[cfg(test)]
mod tests {
    use super::{from_total_order, sort_by_number, total_order};

    #[test]
    fn items_with_equal_numbers_keep_their_order() {
        let mut items: Vec<(i64, usize)> =
            [3, -1, 3, 0, -1, i64::MIN].into_iter().zip(0..).collect();
        let mut sorted = items.clone();
        sorted.sort_by_key(|(key, _)| *key);
        sort_by_number(&mut items, |(key, _)| *key);
        assert_eq!(items, sorted);
    }

    #[test]
    fn total_order_is_that_of_the_standard_library() {
        let numbers = [f64::NEG_INFINITY, -2.5, -f64::MIN_POSITIVE, -0.0, 0.0, 1e-300, 7.0];
        let numbers = numbers.into_iter().chain([f64::INFINITY, f64::NAN, -f64::NAN]);
        let numbers: Vec<f64> = numbers.collect();
        for a in &numbers {
            assert_eq!(from_total_order(total_order(*a)).to_bits(), a.to_bits());
            for b in &numbers {
                assert_eq!(total_order(*a).cmp(&total_order(*b)), a.total_cmp(b), "{a} {b}");
            }
        }
    }
}

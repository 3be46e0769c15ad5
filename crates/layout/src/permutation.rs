//! Another order for a list of things.

/// Another order for things 0, 1, 2, ...
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Permutation {
    /// The thing at each place.
    order: Vec<u32>,
}

impl Permutation {
    /// The order that things have already.
    pub fn identity(count: usize) -> Permutation {
        Permutation { order: (0..count as u32).collect() }
    }

    /// The order in which things are listed; `None` if one is missing or there twice.
    pub fn of_order(order: Vec<u32>) -> Option<Permutation> {
        let mut is_there = vec![false; order.len()];
        let good = order.iter().all(|&i| {
            let seen = is_there.get_mut(i as usize);
            seen.is_some_and(|seen| !std::mem::replace(seen, true))
        });
        good.then_some(Permutation { order })
    }

    /// The order by a key for each thing; of equal keys the first stays first.
    pub fn by_key<K: Ord>(keys: &[K]) -> Permutation {
        let mut order: Vec<u32> = (0..keys.len() as u32).collect();
        order.sort_by_key(|&i| &keys[i as usize]);
        Permutation { order }
    }

    /// The thing at each place.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The place of each thing.
    pub fn places(&self) -> Vec<u32> {
        let mut places = vec![0; self.order.len()];
        for (place, &thing) in (0..).zip(&self.order) {
            places[thing as usize] = place;
        }
        places
    }

    /// `things` in this order.
    ///
    /// # Panics
    /// If they are not as many as this is for.
    pub fn apply<T>(&self, things: Vec<T>) -> Vec<T> {
        assert_eq!(things.len(), self.order.len(), "things and places");
        let mut things: Vec<Option<T>> = things.into_iter().map(Some).collect();
        self.order.iter().map(|&i| things[i as usize].take().expect("every thing is named once")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_go_where_they_belong() {
        let permutation = Permutation::of_order(vec![2, 0, 1]).unwrap();
        assert_eq!(permutation.apply(vec!['a', 'b', 'c']), ['c', 'a', 'b']);
        assert_eq!(permutation.places(), [1, 2, 0]);
        assert_eq!(Permutation::by_key(&[3, 1, 3, 2]).order(), [1, 3, 0, 2]);
        assert_eq!(Permutation::identity(3).order(), [0, 1, 2]);
    }

    #[test]
    fn what_is_no_permutation_is_refused() {
        assert_eq!(Permutation::of_order(vec![0, 0]), None);
        assert_eq!(Permutation::of_order(vec![1, 2]), None);
    }
}

//! Which nodes have a district in common: neighbours, as many as have about the triangles that the
//! children of a node have.
//!
//! All nodes of a level are halved across the longest side of what their middles span, in
//! proportion to the groups that each half becomes, and the halves again. Neither the order in which nodes
//! come nor what blocks or inputs they are of matters.

use std::cmp::Ordering;

/// A group has at most so many times the members that a node has children: members of few triangles
/// each would otherwise make nodes that are replaced by very many at once.
const MOST_MEMBERS: usize = 4;

/// A node that may become a member of a group.
#[derive(Clone, Debug)]
pub struct Item<'a> {
    /// Least corner of its box.
    pub low: [f64; 3],
    /// Greatest corner of its box.
    pub high: [f64; 3],
    /// Its triangles.
    pub triangles: u64,
    /// Decides between nodes of one box.
    pub name: &'a str,
}

impl Item<'_> {
    fn middle(&self, axis: usize) -> f64 {
        0.5 * (self.low[axis] + self.high[axis])
    }

    /// By place, so that what files are called and where they stand changes nothing.
    pub fn order(&self, other: &Self) -> Ordering {
        let corners = |item: &Self| [item.low, item.high];
        let places = corners(self).into_iter().flatten().zip(corners(other).into_iter().flatten());
        let by_place = places.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne());
        by_place.unwrap_or_else(|| self.name.cmp(other.name))
    }
}

/// Divides nodes into groups of about `triangles` each, by their numbers; `children` is what nodes have
/// elsewhere.
pub fn groups(items: &[Item], triangles: f64, children: usize) -> Vec<Vec<usize>> {
    let all: u64 = items.iter().map(|item| item.triangles).sum();
    let by_triangles = (all as f64 / triangles).round() as usize;
    let least = items.len().div_ceil(MOST_MEMBERS * children);
    // A group of one would be its member once more.
    let count = by_triangles.max(least).min(items.len() / 2).max(1);
    let mut members: Vec<usize> = (0..items.len()).collect();
    let mut groups = Vec::with_capacity(count);
    halve(items, &mut members, count, &mut groups);
    groups
}

/// Divides `members` into `count` groups.
fn halve(items: &[Item], members: &mut [usize], count: usize, groups: &mut Vec<Vec<usize>>) {
    if count < 2 || members.len() < 4 {
        members.sort_by(|&a, &b| items[a].order(&items[b]));
        groups.push(members.to_vec());
        return;
    }
    let span = |axis: usize| {
        let middles = members.iter().map(|&member| items[member].middle(axis));
        let (low, high) = middles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        high - low
    };
    // The first of equals.
    let axis = [2, 1, 0].into_iter().max_by(|&a, &b| span(a).total_cmp(&span(b))).unwrap_or(0);
    members.sort_by(|&a, &b| {
        let middles = items[a].middle(axis).total_cmp(&items[b].middle(axis));
        middles.then_with(|| items[a].order(&items[b]))
    });
    let first = count / 2;
    let all: u64 = members.iter().map(|&member| items[member].triangles).sum();
    let aim = all as f64 * first as f64 / count as f64;
    let mut at = 0;
    let mut sum = 0.0;
    while at < members.len() {
        let next = sum + items[members[at]].triangles as f64;
        if next - aim > aim - sum {
            break;
        }
        (at, sum) = (at + 1, next);
    }
    // Each group has two members at least.
    let (least, most) = (2 * first, members.len() - 2 * (count - first));
    let (below, above) = members.split_at_mut(at.clamp(least, most));
    halve(items, below, first, groups);
    halve(items, above, count - first, groups);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A field of squares of 10 m.
    fn field(across: usize, names: &[String]) -> Vec<Item<'_>> {
        let low = |number: usize| [(number % across) as f64, (number / across) as f64, 0.0];
        let item = |name, low: [f64; 3]| Item {
            low: low.map(|at| 10.0 * at),
            high: low.map(|at| 10.0 * at + 10.0),
            triangles: 2000,
            name,
        };
        names.iter().enumerate().map(|(number, name)| item(name, low(number))).collect()
    }

    #[test]
    fn squares_become_squares_of_neighbours() {
        let names: Vec<String> = (0..64).map(|number| format!("{number:02}")).collect();
        let items = field(8, &names);
        let found = groups(&items, 8000.0, 4);
        assert_eq!(found.len(), 16);
        for group in &found {
            assert_eq!(group.len(), 4);
            let across = |axis: usize| {
                let low = group.iter().map(|&at| items[at].low[axis]).fold(f64::MAX, f64::min);
                let high = group.iter().map(|&at| items[at].high[axis]).fold(f64::MIN, f64::max);
                high - low
            };
            assert_eq!([across(0), across(1)], [20.0, 20.0], "{group:?}");
        }
    }

    #[test]
    fn groups_are_the_same_for_any_order() {
        let names: Vec<String> = (0..70).map(|number| format!("{number:02}")).collect();
        let items = field(10, &names);
        let named = |items: &[Item]| {
            let mut all: Vec<Vec<String>> = groups(items, 8000.0, 4)
                .iter()
                .map(|group| group.iter().map(|&at| items[at].name.to_string()).collect())
                .collect();
            all.sort();
            all
        };
        let mut turned = items.clone();
        turned.reverse();
        turned.swap(3, 40);
        assert_eq!(named(&items), named(&turned));
    }

    #[test]
    fn every_node_is_in_one_group_and_none_is_alone() {
        for count in 2..60 {
            let names: Vec<String> = (0..count).map(|number| format!("{number:02}")).collect();
            let mut items = field(7, &names);
            // Some with very many triangles, and some with hardly any.
            for (number, item) in items.iter_mut().enumerate() {
                item.triangles = [5, 20_000, 900][number % 3];
            }
            let found = groups(&items, 8000.0, 4);
            let mut all: Vec<usize> = found.iter().flatten().copied().collect();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<_>>());
            assert!(found.iter().all(|group| group.len() >= 2), "{found:?}");
        }
        let names: Vec<String> = (0..200).map(|number| format!("{number:03}")).collect();
        let mut items = field(20, &names);
        items.iter_mut().for_each(|item| item.triangles = 12);
        let found = groups(&items, 8000.0, 4);
        assert!(found.iter().all(|group| group.len() <= 17), "{found:?}");
    }
}

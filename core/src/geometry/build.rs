//! Building: bounds → binary tree (obvhs) → plan → nodes, blocks, analytic leaves.

use std::time::Duration;

use obvhs::{Boundable, BvhBuildParams, aabb::Aabb, bvh2::builder::build_bvh2};

use super::analytic::Analytic;
use super::collapse::{BinNode, BinTree, Plan};
use super::layout::{Block, Child, MAX_DEPTH, Node, Tree, WIDTH, on_huge_pages};
use super::primitives::{Bounded, PrimRef, Primitives, bounds};

/// Builds the tree. The result does not depend on the number of threads.
pub(super) fn build(prims: &Primitives) -> Tree {
    let bounded = bounds(prims);
    if bounded.is_empty() {
        return Tree::empty();
    }
    let tree = emit(&binary(&bounded), prims);
    let tree = if tree.depth > MAX_DEPTH { emit(&median(&bounded), prims) } else { tree };
    Tree { nodes: on_huge_pages(tree.nodes), blocks: on_huge_pages(tree.blocks), ..tree }
}

/// obvhs' binary tree with one primitive a leaf; the leaves are ours to form. Where areas would
/// underflow, the balanced tree.
fn binary(bounded: &[Bounded]) -> BinTree {
    if areas_underflow(bounded) {
        return median(bounded);
    }
    let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
    let jittered: Vec<Bounded> = bounded.iter().map(Bounded::jittered).collect();
    let bvh = build_bvh2(&jittered, params, &mut Duration::default());
    let nodes = bvh
        .nodes
        .iter()
        .map(|n| BinNode {
            min: [0.0; 3],
            max: [0.0; 3],
            first: n.first_index,
            count: n.prim_count,
        })
        .collect();
    let mut tree = BinTree { nodes, order: bvh.primitive_indices };
    tree.refit(|i| {
        let b = bounded[i as usize].aabb();
        (b.min.to_array(), b.max.to_array())
    });
    for i in &mut tree.order {
        *i = bounded[*i as usize].prim;
    }
    tree
}

/// Whether many boxes are so small beside the whole that f32 cannot hold their areas.
fn areas_underflow(bounded: &[Bounded]) -> bool {
    let size = |b: &Aabb| (b.max - b.min).max_element();
    let whole = bounded.iter().fold(Aabb::empty(), |a, b| a.union(&b.aabb()));
    let least = (size(&whole) * 1e-15).max(1e-18);
    bounded.iter().filter(|b| size(&b.aabb()) < least).count() > 64
}

/// Balanced tree by halving along the widest axis of the centroids: for the input, if there is any,
/// whose best tree is deeper than the traversal's stack.
fn median(bounded: &[Bounded]) -> BinTree {
    let mut ids: Vec<usize> = (0..bounded.len()).collect();
    let mut nodes = vec![BinNode { min: [0.0; 3], max: [0.0; 3], first: 0, count: 0 }];
    let mut todo = vec![(0_usize, 0_usize, bounded.len())];
    while let Some((n, from, to)) = todo.pop() {
        let run = &mut ids[from..to];
        let mut whole = bounded[run[0]].aabb();
        let mut centers = (whole.center(), whole.center());
        for &i in run.iter() {
            let b = bounded[i].aabb();
            whole = whole.union(&b);
            centers = (centers.0.min(b.center()), centers.1.max(b.center()));
        }
        let (min, max) = (whole.min.to_array(), whole.max.to_array());
        if to - from == 1 {
            nodes[n] = BinNode { min, max, first: from as u32, count: 1 };
            continue;
        }
        let axis = (centers.1 - centers.0).max_position();
        let key = |i: usize| bounded[i].aabb().center()[axis];
        run.sort_unstable_by(|&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        let (first, mid) = (nodes.len(), from + (to - from) / 2);
        nodes[n] = BinNode { min, max, first: first as u32, count: 0 };
        nodes.extend([nodes[n]; 2]);
        todo.push((first + 1, mid, to));
        todo.push((first, from, mid));
    }
    BinTree { nodes, order: ids.into_iter().map(|i| bounded[i].prim).collect() }
}

/// Lays out the planned tree, nodes and leaves depth first.
fn emit(bin: &BinTree, prims: &Primitives) -> Tree {
    let plan = Plan::new(bin, prims.triangles.len());
    let mut out = Tree::empty();
    let mut scratch = vec![];
    if plan.is_leaf(0) {
        out.root = Some(leaf(bin, 0, prims, &mut out, &mut scratch));
        return out;
    }
    out.root = Some(Child::node(0));
    out.nodes.push(Node::EMPTY);
    let mut todo = vec![(0_usize, 0_usize, 1_usize)];
    let mut children = vec![];
    while let Some((n, at, level)) = todo.pop() {
        out.depth = out.depth.max(level);
        plan.wide_children(n, &mut children);
        // The any-hit walk begins with the last child: the largest is the likeliest to occlude.
        let area = |c: usize| bin.nodes[c].half_area();
        children.sort_by(|&a, &b| area(a).total_cmp(&area(b)));
        let mut inner = vec![];
        for (slot, &c) in children.iter().enumerate() {
            let bounds = &bin.nodes[c];
            for axis in 0..3 {
                out.nodes[at].rows[axis][slot] = bounds.min[axis];
                out.nodes[at].rows[3 + axis][slot] = bounds.max[axis];
            }
            out.nodes[at].child[slot] = if plan.is_leaf(c) {
                leaf(bin, c, prims, &mut out, &mut scratch)
            } else {
                out.nodes.push(Node::EMPTY);
                inner.push((c, out.nodes.len() - 1, level + 1));
                Child::node(out.nodes.len() - 1)
            };
        }
        todo.extend(inner.into_iter().rev());
    }
    out
}

/// Appends the leaf for subtree `n`, which holds triangles only or analytic primitives only.
fn leaf(
    bin: &BinTree,
    n: usize,
    prims: &Primitives,
    out: &mut Tree,
    scratch: &mut Vec<u32>,
) -> Child {
    bin.prims(n, scratch);
    let (blocks, analytic) = (out.blocks.len(), out.analytic.len());
    for (i, &prim) in scratch.iter().enumerate() {
        match prims.get(prim) {
            Some(PrimRef::Triangle(tri)) => {
                let lane = i % WIDTH;
                if lane == 0 {
                    out.blocks.push(Block::EMPTY);
                }
                if let Some(block) = out.blocks.last_mut() {
                    block.prim[lane] = prim;
                    for (corner, v) in tri.iter().enumerate() {
                        for axis in 0..3 {
                            block.rows[3 * corner + axis][lane] = v[axis];
                        }
                    }
                }
            }
            Some(PrimRef::Sphere(s)) => out.analytic.push(Analytic::sphere(prim, s)),
            Some(PrimRef::Disk(d)) => out.analytic.push(Analytic::disk(prim, d)),
            Some(PrimRef::Cylinder(c)) => out.analytic.push(Analytic::cylinder(prim, c)),
            None => debug_assert!(false, "the builder made up primitive {prim}"),
        }
    }
    if out.blocks.len() > blocks {
        Child::blocks(blocks, out.blocks.len() - blocks)
    } else {
        Child::analytic(analytic, out.analytic.len() - analytic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn soup(count: usize) -> Primitives {
        let v = |i: usize, j: usize| {
            let x = (i * 3 + j) as f32 * 0.618_034;
            Vec3::new(x.fract(), (x * 7.3).fract(), (x * 13.7).fract()) * 0.5
        };
        let triangles = (0..count).map(|i| [v(i, 0), v(i, 1), v(i, 2)]).collect();
        Primitives { triangles, ..Primitives::default() }
    }

    fn ids(tree: &Tree) -> Vec<u32> {
        let lanes = tree.blocks.iter().flat_map(|b| b.prim).filter(|p| *p != u32::MAX);
        let mut ids: Vec<u32> = lanes.chain(tree.analytic.iter().map(|a| a.prim)).collect();
        ids.sort_unstable();
        ids
    }

    #[test]
    fn every_primitive_lies_in_exactly_one_leaf() {
        for count in [1, 2, 7, 8, 9, 17, 1000] {
            let prims = soup(count);
            let all: Vec<u32> = (0..count as u32).collect();
            assert_eq!(ids(&build(&prims)), all);
            assert_eq!(ids(&emit(&median(&bounds(&prims)), &prims)), all);
        }
    }

    #[test]
    fn the_balanced_tree_is_shallow_even_for_equal_boxes() {
        let prims = Primitives { triangles: vec![soup(1).triangles[0]; 5000], ..soup(0) };
        let tree = emit(&median(&bounds(&prims)), &prims);
        assert!(tree.depth <= 13, "depth {}", tree.depth);
        assert_eq!(ids(&tree).len(), 5000);
    }

    #[test]
    fn the_same_tree_comes_out_of_any_number_of_threads() {
        let prims = soup(20_000);
        let bits = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let tree = pool.map(|p| p.install(|| build(&prims))).map_err(|e| e.to_string())?;
            let nodes: Vec<_> =
                tree.nodes.iter().map(|n| (n.rows.map(|r| r.map(f32::to_bits)), n.child)).collect();
            Ok::<_, String>((nodes, tree.blocks.iter().map(|b| b.prim).collect::<Vec<_>>()))
        };
        let one = bits(1);
        assert!(one.is_ok());
        assert!(one == bits(2) && one == bits(7));
    }
}

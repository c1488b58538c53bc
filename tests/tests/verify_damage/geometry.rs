//! Damages of the geometry: meshes, views, and the primitives of their tiles.

use super::damages::{Damage, damage};
use super::trace::Trace;
use formats::textrace::geometry::{GeometryView, TileLists, ViewTarget};

pub fn of_meshes() -> Vec<Damage> {
    let rows = |field: &str, what: &str, change: fn(&mut Trace)| damage(field, what, change);
    vec![
        rows("mesh: vertices", "+ 1", |t| {
            t.geometry.meshes[0].vertices += 1
        }),
        rows("mesh: bytes of a vertex", "+ 4", |t| {
            t.geometry.meshes[0].vertex_bytes += 4
        }),
        rows("mesh: bytes of an index", "2 for 4", |t| {
            t.geometry.meshes[0].index_bytes = 2
        }),
        rows("mesh: index", "the first triangle's last one - 1", |t| {
            let indices = &mut t.geometry.meshes[0].indices;
            indices[2] = indices[2].checked_sub(1).unwrap_or(indices[2] + 1);
        }),
        rows("mesh: indices", "a triangle turned over", |t| {
            t.geometry.meshes[0].indices.swap(0, 1);
        }),
        rows("mesh: indices", "the last two triangles exchanged", |t| {
            let mesh = t
                .geometry
                .meshes
                .iter_mut()
                .find(|mesh| mesh.indices.len() >= 6);
            let indices = &mut mesh.expect("two triangles").indices;
            let count = indices.len();
            indices[count - 6..].rotate_left(3);
        }),
        rows("draw: mesh", "another one of as many triangles", |t| {
            let triangles = |mesh: u32| t.geometry.meshes[mesh as usize].indices.len();
            let own = |draw: usize| t.geometry.draw_meshes[draw];
            let pair = (0..t.geometry.draw_meshes.len()).find_map(|draw| {
                let fits =
                    |&other: &u32| other != own(draw) && triangles(other) == triangles(own(draw));
                Some((draw, (0..t.geometry.meshes.len() as u32).find(fits)?))
            });
            let (draw, other) = pair.expect("two meshes of as many triangles");
            t.geometry.draw_meshes[draw] = other;
        }),
        rows("mesh table", "one more", |t| {
            let next = t.geometry.meshes[0].clone();
            t.geometry.meshes.push(next);
        }),
    ]
}

/// The first view that is a pass, or a shadow map.
fn view(trace: &Trace, is_pass: bool) -> usize {
    let of = |target: ViewTarget| matches!(target, ViewTarget::Pass(_)) == is_pass;
    let mut views = trace.geometry.views.iter();
    views.position(|view| of(view.target)).expect("a view")
}

/// A tile whose list has several primitives, in the middle of the view.
fn full_tile(lists: &TileLists) -> usize {
    let tiles = lists.starts.len() - 1;
    let mut tiles = (tiles / 3..tiles).chain(0..tiles);
    tiles
        .find(|tile| lists.tile(*tile).len() > 4)
        .expect("a tile")
}

/// A primitive of a submitted draw that is not in a tile's list.
fn absent(trace: &Trace, view: usize, tile: usize) -> u32 {
    let lists = &trace.lists[view];
    let submitted = lists
        .draws
        .iter()
        .map(|draw| &trace.tables.draws[*draw as usize]);
    let mut primitives =
        submitted.flat_map(|d| d.first_primitive..d.first_primitive + d.primitives);
    let absent = |primitive: &u32| lists.tile(tile).binary_search(primitive).is_err();
    primitives.find(absent).expect("a primitive")
}

/// Whether a primitive has records in a tile of the left eye.
fn is_recorded(trace: &Trace, tile: usize, primitive: u32) -> bool {
    trace.tiles[0][tile]
        .runs
        .iter()
        .any(|run| run.primitive == primitive)
}

/// Removes primitives from as many lists: from each the last one that has or has no records.
fn remove(trace: &mut Trace, recorded: bool, count: usize) {
    let number = view(trace, true);
    let lists = &trace.lists[number];
    let mut tiles = (lists.starts.len() - 1) / 3..lists.starts.len() - 1;
    let of_tile = |tile: usize| {
        let mut list = lists.tile(tile).iter().rev();
        let found = list.find(|primitive| is_recorded(trace, tile, **primitive) == recorded);
        Some((tile, *found?))
    };
    let found: Vec<_> = tiles.by_ref().filter_map(of_tile).take(count).collect();
    assert_eq!(found.len(), count);
    for (tile, primitive) in found {
        let mut list = trace.lists[number].tile(tile).to_vec();
        list.retain(|other| *other != primitive);
        trace.replace(number, tile, &list);
    }
}

pub fn of_lists() -> Vec<Damage> {
    let rows = |field: &str, what: &str, change: fn(&mut Trace)| damage(field, what, change);
    let mut all = vec![
        rows("list of a picture", "a primitive with records less", |t| {
            remove(t, true, 1)
        }),
        // Rounding may decide whether a primitive is in a tile, so one may be missing.
        Damage {
            field: "list of a picture".into(),
            sizes: [1, 4, 16]
                .map(|count| {
                    let what = format!("a hidden primitive less in {count} tiles");
                    let mut one = damage("", &what, move |t| remove(t, false, count));
                    one.sizes.remove(0)
                })
                .into(),
        },
    ];
    for (is_pass, field) in [(true, "list of a picture"), (false, "list of a shadow map")] {
        let edit = move |what: &str, change: fn(&mut Vec<u32>)| {
            damage(field, what, move |t: &mut Trace| {
                let number = view(t, is_pass);
                let tile = full_tile(&t.lists[number]);
                let mut list = t.lists[number].tile(tile).to_vec();
                change(&mut list);
                t.replace(number, tile, &list);
            })
        };
        all.push(edit("its first primitive less", |list| {
            list.remove(0);
        }));
        all.push(edit("empty", Vec::clear));
        all.push(damage(field, "a primitive more", move |t| {
            let number = view(t, is_pass);
            let tile = full_tile(&t.lists[number]);
            let mut list = t.lists[number].tile(tile).to_vec();
            list.push(absent(t, number, tile));
            list.sort_unstable();
            t.replace(number, tile, &list);
        }));
        all.push(damage(field, "that of the next tile", move |t| {
            let number = view(t, is_pass);
            let lists = &t.lists[number];
            let tile = full_tile(lists);
            let next = (tile + 1..).find(|next| lists.tile(*next) != lists.tile(tile));
            let list = lists.tile(next.expect("another list")).to_vec();
            t.replace(number, tile, &list);
        }));
        all.push(damage(field, "a draw and its primitives less", move |t| {
            let number = view(t, is_pass);
            let lists = &t.lists[number];
            let primitive = lists.tile(full_tile(lists))[0];
            t.leave_out(number, t.draw_of(primitive));
        }));
    }
    all.push(rows("lists", "those of both eyes exchanged", |t| {
        let left = view(t, true);
        t.lists.swap(left, left + 1);
    }));
    all.push(rows(
        "lists",
        "those of the first two shadow maps exchanged",
        |t| t.lists.swap(0, 1),
    ));
    all.push(rows(
        "view",
        "the shadow map less that is looked up most",
        |t| {
            let looked_up = t.most_looked_up();
            let is_it = |view: &GeometryView| view.target == ViewTarget::ShadowMap(looked_up);
            let view = t
                .geometry
                .views
                .iter()
                .position(is_it)
                .expect("a shadow map");
            t.geometry.views.remove(view);
            t.lists.remove(view);
        },
    ));
    all.push(rows("view: number of a shadow map", "9", |t| {
        let last = view(t, true) - 1;
        t.geometry.views[last].target = ViewTarget::ShadowMap(9);
    }));
    for axis in [0, 1] {
        let field = [
            "view: width of a shadow map",
            "view: height of a shadow map",
        ][axis];
        all.push(damage(field, "- 16", move |t| {
            let number = view(t, false);
            let lists = t.lists[number].clone();
            let size_px = &mut t.geometry.views[number].size_px;
            let columns = size_px[0].div_ceil(16) as usize;
            size_px[axis] -= 16;
            // The last column or row of tiles less.
            let mut less = TileLists {
                draws: lists.draws.clone(),
                starts: vec![0],
                primitives: Vec::new(),
            };
            for tile in 0..lists.starts.len() - 1 {
                let is_last = match axis {
                    0 => tile % columns == columns - 1,
                    _ => tile / columns == size_px[1].div_ceil(16) as usize,
                };
                if !is_last {
                    less.primitives.extend(lists.tile(tile));
                    less.starts.push(less.primitives.len() as u32);
                }
            }
            t.lists[number] = less;
        }));
    }
    all
}

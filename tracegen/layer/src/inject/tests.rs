mod growth;

use super::*;
use proptest::prelude::*;
use rspirv::spirv::ExecutionModel::{self, Fragment, GLCompute, Vertex};
use spool::{Access, Binding, Form, Lod, Shape, TextureSite, What};
use std::io::Write;
use std::process::{Command, Stdio};

const TARGET: Target = Target {
    address: 0x7f00_dead_0000,
    push_constant_bytes: 252,
    ballots: true,
    multiview: false,
};

/// Declarations of all shaders in these tests.
const HEAD: &str = "
@group(0) @binding(0) var color: texture_2d<f32>;
@group(0) @binding(1) var linear: sampler;
@group(0) @binding(2) var normals: texture_2d<f32>;
@group(1) @binding(0) var layers: texture_2d_array<f32>;
@group(1) @binding(1) var sky: texture_cube<f32>;
@group(1) @binding(2) var depth: texture_depth_2d;
@group(1) @binding(3) var compare: sampler_comparison;
@group(1) @binding(4) var volume: texture_3d<f32>;
struct In {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) @interpolate(flat) number: u32,
}
";

/// SPIR-V of a fragment shader's body in WGSL.
fn shader(body: &str) -> Vec<u32> {
    module(&format!(
        "{HEAD}\n@fragment fn main(in: In) -> @location(0) vec4<f32> {{\n{body}\n}}"
    ))
}

fn module(text: &str) -> Vec<u32> {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator
        .validate(&module)
        .unwrap_or_else(|e| panic!("{text}: {e:?}"));
    let options = naga::back::spv::Options::default();
    naga::back::spv::write_vec(&module, &info, &options, None).expect("SPIR-V")
}

/// Rewrites a shader for every target, and validates the results with `spirv-val` if it is installed.
fn instrumented(words: &[u32]) -> Rewritten {
    instrumented_entry(words, "main", Fragment)
}

fn instrumented_entry(words: &[u32], entry: &str, stage: ExecutionModel) -> Rewritten {
    for (ballots, multiview) in [(false, false), (false, true), (true, true)] {
        let target = Target {
            ballots,
            multiview,
            ..TARGET
        };
        validate(
            &instrument(words, Some(entry), stage, &target)
                .expect("a recording shader")
                .words,
        );
    }
    let recording = instrument(words, Some(entry), stage, &TARGET).expect("a recording shader");
    validate(&recording.words);
    recording
}

fn validate(words: &[u32]) {
    let started = Command::new("spirv-val")
        .args(["--target-env", "vulkan1.3", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let Ok(mut child) = started else {
        eprintln!("SKIPPED: spirv-val is absent");
        return;
    };
    let bytes: &[u8] = bytemuck::cast_slice(words);
    child
        .stdin
        .take()
        .expect("a pipe")
        .write_all(bytes)
        .expect("a pipe");
    let output = child.wait_with_output().expect("it ends");
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&text)
    );
}

fn textures(recording: &Rewritten) -> Vec<&TextureSite> {
    recording
        .sites
        .iter()
        .filter_map(|site| match &site.what {
            What::Texture(texture) => Some(texture),
            _ => None,
        })
        .collect()
}

fn binding(set: u32, binding: u32) -> Binding {
    Binding {
        set,
        binding,
        element: Some(0),
    }
}

#[test]
fn a_plain_sample_is_one_quad_site_that_covers_its_fragments() {
    let recording = instrumented(&shader("return textureSample(color, linear, in.uv);"));
    assert_eq!(recording.tests, DepthTests::Either);
    let [site] = &recording.sites[..] else {
        panic!("{:?}", recording.sites);
    };
    assert!(site.unconditional);
    assert_eq!(site.form, Form::Quad);
    let texture = TextureSite {
        access: Access::Sample,
        shape: Shape::Flat,
        image: binding(0, 0),
        sampler: Some(binding(0, 1)),
        lod: Lod::Derivatives,
        offset: [0; 2],
    };
    assert_eq!(site.what, What::Texture(texture));
}

#[test]
fn textures_at_the_same_coordinates_share_a_group() {
    let recording = instrumented(&shader(
        "var uv = in.uv * 2.0;
        let a = textureSample(color, linear, in.uv * 2.0);
        let b = textureSample(normals, linear, uv);
        uv.x = b.x;
        let c = textureSample(color, linear, uv);
        let d = textureSample(normals, linear, uv, vec2<i32>(1, -2));
        return a + b + c + d;",
    ));
    assert_eq!(groups(&recording), [0, 0, 1, 1]);
    assert_eq!(calls(&recording), 1);
    assert_eq!(textures(&recording)[3].offset, [1, -2]);
}

fn groups(recording: &Rewritten) -> Vec<u16> {
    recording.sites.iter().map(|site| site.group).collect()
}

/// Number of calls that record, in a module that had no calls before it was rewritten. One more call prepares.
fn calls(recording: &Rewritten) -> usize {
    number_of(&recording.words, Op::FunctionCall) - 1
}

#[test]
fn unchanged_lanes_are_recorded_once_and_changed_lanes_again() {
    let text = |between: &str| {
        shader(&format!(
            "var c = textureSample(color, linear, in.uv);
            {between}
            return c + textureSample(color, linear, c.xy) + textureSample(normals, linear, in.uv);"
        ))
    };
    let branch = "if in.number > 1u { c += textureSampleLevel(color, linear, in.uv * 3.0, 0.0); }";
    let recording = instrumented(&text(branch));
    // The branch has its own record; the others are in one record of two groups.
    assert_eq!(groups(&recording), [0, 2, 1, 0]);
    assert_eq!(calls(&recording), 2);
    // After a discard fewer lanes are active: the start, two records, the end.
    let recording = instrumented(&text("if c.x > 0.5 { discard; }"));
    assert_eq!(groups(&recording)[..3], [0, 1, 2]);
    assert_eq!(calls(&recording), 4);
}

#[test]
fn a_record_has_eight_groups_at_most() {
    let samples = |count: u32| {
        let one = |i| format!("c += textureSample(color, linear, in.uv * {i}.0);");
        let all: String = (2..2 + count).map(one).collect();
        shader(&format!("var c = vec4<f32>(0.0); {all} return c;"))
    };
    for (count, records) in [(8, 1), (9, 2), (17, 3)] {
        let recording = instrumented(&samples(count));
        assert_eq!(calls(&recording), records);
        assert_eq!(groups(&recording), (0..count as u16).collect::<Vec<_>>());
    }
}

fn number_of(words: &[u32], wanted: Op) -> usize {
    let module = rspirv::dr::load_words(words).expect("a module");
    let all = module.all_inst_iter();
    all.filter(|i| i.class.opcode == wanted).count()
}

/// A shader with every source of a level of detail.
fn every_lod() -> Vec<u32> {
    shader(
        "var c = textureSampleBias(color, linear, in.uv, -1.5);
        c += textureSampleBias(color, linear, in.uv, in.normal.x);
        c += textureSampleLevel(color, linear, in.uv, 3.0);
        c += textureSampleLevel(color, linear, in.uv, in.normal.y);
        c += textureSampleGrad(color, linear, in.uv, in.normal.xy, in.normal.yz);
        c += textureLoad(color, vec2<i32>(in.uv), 2);
        c += textureGather(1, color, linear, in.uv);
        c.x += textureSampleCompare(depth, compare, in.uv, 0.5);
        c.x += textureSampleCompareLevel(depth, compare, in.uv, 0.5);
        return c;",
    )
}

#[test]
fn every_source_of_a_level_of_detail_is_recognised() {
    let recording = instrumented(&every_lod());
    let found: Vec<_> = textures(&recording)
        .iter()
        .map(|texture| (texture.access, texture.lod))
        .collect();
    let sample = |lod| (Access::Sample, lod);
    assert_eq!(
        found,
        [
            sample(Lod::Bias(Some(-1.5))),
            sample(Lod::Bias(None)),
            sample(Lod::Explicit(Some(3.0))),
            sample(Lod::Explicit(None)),
            sample(Lod::Gradients),
            (Access::Fetch, Lod::Explicit(Some(2.0))),
            (Access::Gather, Lod::Explicit(Some(0.0))),
            sample(Lod::Derivatives),
            sample(Lod::Explicit(Some(0.0))),
        ]
    );
    let forms: Vec<Form> = recording.sites.iter().map(|site| site.form).collect();
    use Form::{Fragment, Quad};
    assert_eq!(
        forms[..9],
        [
            Quad, Fragment, Quad, Fragment, Fragment, Quad, Quad, Quad, Quad
        ]
    );
}

#[test]
fn arrays_and_cubes_have_records_of_fragments_and_volumes_are_left_out_by_name() {
    let recording = instrumented(&shader(
        "let a = textureSample(layers, linear, in.uv, in.number);
        let b = textureSample(sky, linear, in.normal);
        let c = textureSample(volume, linear, in.normal);
        return a + b + c;",
    ));
    let shapes: Vec<_> = textures(&recording)
        .iter()
        .map(|texture| texture.shape)
        .collect();
    assert_eq!(shapes, [Shape::Array, Shape::Cube]);
    let left_out = What::LeftOut("three-dimensional textures".to_owned());
    assert_eq!(recording.sites[2].what, left_out);
    // None of the three records determines the coverage of a quad.
    assert_eq!(
        recording.sites.last().map(|site| &site.what),
        Some(&What::LeftOut("three-dimensional textures".to_owned()))
    );
}

#[test]
fn a_shader_without_textures_records_its_fragments() {
    let recording = instrumented(&shader("return vec4<f32>(in.normal, 1.0);"));
    let [site] = &recording.sites[..] else {
        panic!("{:?}", recording.sites);
    };
    assert_eq!((&site.what, site.unconditional), (&What::Coverage, true));
}

#[test]
fn samples_of_a_branch_do_not_cover_the_quad() {
    let recording = instrumented(&shader(
        "var c = vec4<f32>(0.0);
        for (var i = 0u; i < in.number; i++) {
            if in.normal.x > f32(i) { c += textureSampleLevel(color, linear, in.uv * f32(i), 0.0); }
        }
        return c;",
    ));
    let [inside, coverage] = &recording.sites[..] else {
        panic!("{:?}", recording.sites);
    };
    assert!(!inside.unconditional);
    assert_eq!(coverage.what, What::Coverage);
}

#[test]
fn a_shader_that_discards_records_started_and_surviving_fragments() {
    let recording = instrumented(&shader(
        "let c = textureSample(color, linear, in.uv);
        if c.a < 0.5 { discard; }
        return c;",
    ));
    assert_eq!(recording.tests, DepthTests::EarlyLateWrite);
    let what: Vec<_> = recording.sites.iter().map(|site| &site.what).collect();
    assert!(
        matches!(what[..], [What::Texture(_), What::Coverage, What::Survival]),
        "{what:?}"
    );
}

#[test]
fn shaders_that_write_depth_or_memory_are_tested_late() {
    let writes_depth = module(
        "struct Out { @builtin(frag_depth) depth: f32, @location(0) color: vec4<f32> }
        @fragment fn main(@builtin(position) at: vec4<f32>) -> Out { return Out(at.x, at); }",
    );
    let writes_memory = module(
        "@group(0) @binding(0) var<storage, read_write> found: atomic<u32>;
        @fragment fn main() -> @location(0) vec4<f32> { atomicAdd(&found, 1u); return vec4<f32>(0.0); }",
    );
    for words in [writes_depth, writes_memory] {
        assert_eq!(instrumented(&words).tests, DepthTests::Late);
    }
}

#[test]
fn push_constants_of_the_shader_keep_their_offsets() {
    let text = |size: u32| {
        format!(
            "struct Constants {{ scale: array<vec4<f32>, {size}> }}
            var<immediate> constants: Constants;
            @fragment fn main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {{
                return at * constants.scale[{}];
            }}",
            size - 1
        )
    };
    let recording = instrumented(&module(&text(4)));
    assert_eq!(recording.sites.len(), 1);
    assert_eq!(push_constants(&recording.words), 1);
}

/// Number of push constant blocks. Drivers refuse a second one.
fn push_constants(words: &[u32]) -> usize {
    use rspirv::{dr::Operand, spirv::StorageClass};
    let class = Some(&Operand::StorageClass(StorageClass::PushConstant));
    let module = rspirv::dr::load_words(words).expect("a module");
    let globals = module.types_global_values.iter();
    let of = globals.filter(|g| g.class.opcode == Op::Variable && g.operands.first() == class);
    of.count()
}

#[test]
fn unused_push_constant_blocks_also_get_the_number() {
    let unused = "struct Constants { scale: vec4<f32> }
        var<immediate> constants: Constants;
        @vertex fn vertex() -> @builtin(position) vec4<f32> { return constants.scale; }
        @fragment fn main() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }";
    let words = module(unused);
    assert_eq!(push_constants(&words), 1);
    assert_eq!(push_constants(&instrumented(&words).words), 1);
}

#[test]
fn one_entry_point_of_several_is_rewritten() {
    let words = module(&format!(
        "{HEAD}
        @vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {{
            return textureSampleLevel(color, linear, vec2<f32>(f32(i)), 0.0);
        }}
        @fragment fn main(in: In) -> @location(0) vec4<f32> {{ return textureSample(color, linear, in.uv); }}
        @fragment fn other(in: In) -> @location(0) vec4<f32> {{ discard; }}"
    ));
    assert_eq!(instrumented(&words).tests, DepthTests::Either);
    let other = instrument(&words, Some("other"), Fragment, &TARGET).expect("another one");
    assert_eq!(other.tests, DepthTests::EarlyLateWrite);
    let missing =
        instrument(&words, Some("vertex"), Fragment, &TARGET).expect_err("no fragment shader");
    assert_eq!(missing, InjectError::NoFragmentEntry);
}

#[test]
fn textures_reached_through_functions_are_found_if_all_calls_agree() {
    let text = |other: &str| {
        format!(
            "{HEAD}
            fn taken(source: texture_2d<f32>, uv: vec2<f32>) -> vec4<f32> {{
                return textureSample(source, linear, uv);
            }}
            @fragment fn main(in: In) -> @location(0) vec4<f32> {{
                return taken(color, in.uv) + taken({other}, in.uv * 2.0);
            }}"
        )
    };
    let agree = instrumented(&module(&text("color")));
    assert_eq!(textures(&agree)[0].image, binding(0, 0));
    let differ = instrumented(&module(&text("normals")));
    let left_out = What::LeftOut("images that a shader chooses".to_owned());
    assert_eq!(differ.sites[0].what, left_out);
}

#[test]
fn invalid_spirv_is_refused() {
    for words in [&[][..], &[0x0723_0203], &[1, 2, 3, 4, 5]] {
        let error = instrument(words, None, Fragment, &TARGET).expect_err("refused");
        assert!(matches!(error, InjectError::Parse(_)), "{error}");
    }
}

/// A shader with most of the constructs that are rewritten.
fn rich() -> Vec<u32> {
    shader(
        "var c = textureSample(color, linear, in.uv);
        for (var i = 0u; i < in.number; i++) {
            c += textureSampleLevel(layers, linear, in.uv, i, f32(i));
        }
        if c.a < 0.5 { discard; }
        return c + textureSampleBias(sky, linear, in.normal, in.uv.x);",
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn changed_modules_are_rewritten_or_refused_but_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u32>(), 0..3_u8), 1..6),
    ) {
        let mut words = rich();
        for (at, value, kind) in changes {
            let at = at.index(words.len());
            match kind {
                0 => words[at] = value,
                1 => words[at] = words[at].wrapping_add(value % 7).wrapping_sub(3),
                _ => words[at] ^= 1 << (value % 32),
            }
        }
        let _ = instrument(&words, None, Fragment, &TARGET);
    }
}

#[test]
fn image_instructions_of_other_stages_are_counted_by_kind_of_texture() {
    let words = module(&format!(
        "{HEAD}
        @group(2) @binding(0) var target_: texture_storage_2d<rgba8unorm, write>;
        fn helper(uv: vec2<f32>) -> f32 {{ return textureSampleLevel(color, linear, uv, 0.0).x; }}
        @vertex fn skinned(@builtin(vertex_index) n: u32) -> @builtin(position) vec4<f32> {{
            let a = textureLoad(normals, vec2<u32>(n, 0u), 0);
            let b = textureLoad(layers, vec2<u32>(n, 0u), 0, 0) + textureSampleLevel(sky, linear, a.xyz, 0.0);
            return a + b + textureLoad(volume, vec3<u32>(n), 0) + helper(a.xy);
        }}
        @vertex fn plain(@builtin(vertex_index) n: u32) -> @builtin(position) vec4<f32> {{
            return vec4<f32>(f32(n));
        }}
        @compute @workgroup_size(8, 4, 2) fn compute(@builtin(global_invocation_id) id: vec3<u32>) {{
            textureStore(target_, id.xy, textureLoad(color, id.xy, 0));
        }}
        @fragment fn main(in: In) -> @location(0) vec4<f32> {{ return vec4<f32>(0.0); }}"
    ));
    let reads = |entry, stage| -> Vec<(String, u32)> {
        let found = texel_reads(&words, Some(entry), stage).expect("reads");
        found.into_iter().collect()
    };
    let kind = |what: &str, count| (what.to_owned(), count);
    let flat = "two-dimensional textures";
    assert_eq!(
        reads("skinned", Vertex),
        [
            kind("cube maps", 1),
            kind("texture arrays", 1),
            kind("three-dimensional textures", 1),
            kind(flat, 2)
        ]
    );
    let recording = instrumented_entry(&words, "skinned", Vertex);
    let recorded: Vec<_> = (recording.sites.iter().map(|site| (&site.what, site.form)))
        .map(|(what, form)| match what {
            What::Texture(of) => (of.shape, of.access, form),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(
        recorded,
        [
            (Shape::Flat, Access::Sample, Form::Fragment),
            (Shape::Flat, Access::Fetch, Form::Fragment),
            (Shape::Array, Access::Fetch, Form::Fragment),
        ]
    );
    let counted: Vec<_> = recording.unrecorded.into_iter().collect();
    assert_eq!(
        counted,
        [kind("cube maps", 1), kind("three-dimensional textures", 1)]
    );
    assert!(reads("plain", Vertex).is_empty());
    assert!(reads("main", Fragment).is_empty());
    assert_eq!(reads("compute", GLCompute), [kind(flat, 1)]);
    assert!(texel_reads(&words, Some("compute"), Vertex).is_err());
    let size = workgroup_size(&words, Some("compute"), |_| None);
    assert_eq!(size, Ok([8, 4, 2]));
}

#[test]
fn atomics_on_storage_images_are_left_out_by_name() {
    let recording = instrumented(&module(
        "@group(0) @binding(0) var counts: texture_storage_2d<r32uint, atomic>;
        @fragment fn main() -> @location(0) vec4<f32> {
            textureAtomicAdd(counts, vec2<u32>(0u), 1u);
            return vec4<f32>(1.0);
        }",
    ));
    let left_out = What::LeftOut("atomics on storage images".to_owned());
    assert!(
        recording.sites.iter().any(|site| site.what == left_out),
        "{:?}",
        recording.sites
    );
}

/// Assembly of a compute shader whose workgroup has specialisation constants.
fn specialized_workgroup(by_builtin: bool) -> Vec<u32> {
    use rspirv::binary::Assemble;
    use rspirv::dr::{Builder, Operand};
    use rspirv::spirv::{AddressingModel, Capability, Decoration, ExecutionModel, MemoryModel};
    let mut b = Builder::new();
    b.set_version(1, 5);
    b.capability(Capability::Shader);
    b.memory_model(AddressingModel::Logical, MemoryModel::GLSL450);
    let (void, uint) = (b.type_void(), b.type_int(32, 0));
    let sizes = [16, 2].map(|size| b.spec_constant_bit32(uint, size));
    let one = b.constant_bit32(uint, 1);
    for (number, id) in (5..).zip(sizes) {
        b.decorate(id, Decoration::SpecId, [Operand::LiteralBit32(number)]);
    }
    if by_builtin {
        let vector = b.type_vector(uint, 3);
        let all = b.spec_constant_composite(vector, [sizes[0], sizes[1], one]);
        let builtin = Operand::BuiltIn(BuiltIn::WorkgroupSize);
        b.decorate(all, Decoration::BuiltIn, [builtin]);
    }
    let kind = b.type_function(void, []);
    let none = rspirv::spirv::FunctionControl::NONE;
    let main = b
        .begin_function(void, None, none, kind)
        .expect("a function");
    b.begin_block(None).expect("a block");
    b.ret().expect("a return");
    b.end_function().expect("the end");
    b.entry_point(ExecutionModel::GLCompute, main, "main", []);
    match by_builtin {
        true => b.execution_mode(main, ExecutionMode::LocalSize, [1, 1, 1]),
        false => b.execution_mode_id(main, ExecutionMode::LocalSizeId, [sizes[0], sizes[1], one]),
    }
    b.module().assemble()
}

#[test]
fn the_size_of_a_workgroup_may_be_specialised() {
    for by_builtin in [false, true] {
        let words = specialized_workgroup(by_builtin);
        let default = workgroup_size(&words, Some("main"), |_| None);
        assert_eq!(default, Ok([16, 2, 1]), "{by_builtin}");
        let given = workgroup_size(&words, Some("main"), |number| (number == 6).then_some(7));
        assert_eq!(given, Ok([16, 7, 1]), "{by_builtin}");
    }
}

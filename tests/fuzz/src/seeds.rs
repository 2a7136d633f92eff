//! What a target begins from: the project's own scenes and materials, small images of every kind, meshes, bakes; and the
//! words that its files are made of.

use crate::checks::{PART, sign};
use diaphane::image::{Display, Format, Image};
use diaphane::scene::{Kind, Reader};
use exr::prelude::{
    Blocks, Compression, Encoding, Image as Layers, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2,
    WritableImage as _,
};
use image::codecs::{hdr::HdrEncoder, jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder, Rgb};
use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Larger ones only take time.
const LARGEST: usize = 8192;

/// Puts the first inputs of the target `name` in `folder`, and its words in `words.txt` beside it.
pub fn write(name: &str, folder: &Path) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let seeds = match name {
        "image" => images(),
        "obj" => meshes(&root),
        "cache" => bakes(),
        "scene" => texts(&root, Kind::Scene),
        "material" => texts(&root, Kind::Material),
        "bench" => texts(&root, Kind::Bench),
        _ => Vec::new(),
    };
    std::fs::create_dir_all(folder).expect("the folder of seeds can be made");
    for (i, seed) in seeds.iter().filter(|seed| seed.len() <= LARGEST).enumerate() {
        std::fs::write(folder.join(format!("{i:03}")), seed).expect("a seed can be written");
    }
    let lines: String = words(name, &root, &seeds).iter().map(|word| format!("\"{}\"\n", escaped(word))).collect();
    std::fs::write(folder.with_file_name("words.txt"), lines).expect("the words can be written");
}

/// As libFuzzer reads dictionaries.
fn escaped(word: &[u8]) -> String {
    let one = |&byte: &u8| match byte {
        b'"' | b'\\' => format!("\\{}", byte as char),
        b' '..=b'~' => (byte as char).to_string(),
        _ => format!("\\x{byte:02X}"),
    };
    word.iter().map(one).collect()
}

fn words(name: &str, root: &Path, seeds: &[Vec<u8>]) -> BTreeSet<Vec<u8>> {
    let fixed: &[&[u8]] = match name {
        "image" => &[
            b"IHDR",
            b"IDAT",
            b"IEND",
            b"PLTE",
            b"tRNS",
            b"iCCP",
            b"gAMA",
            b"sRGB",
            b"tEXt",
            b"zTXt",
            b"iTXt",
            b"acTL",
            b"fcTL",
            b"fdAT",
            b"#?RADIANCE\n",
            b"#?RGBE\n",
            b"FORMAT=32-bit_rle_rgbe\n",
            b"FORMAT=32-bit_rle_xyze\n",
            b"-Y 2 +X 2\n",
            b"+X 2 -Y 2\n",
            b"EXPOSURE=",
            b"\xff\xc0",
            b"\xff\xc2",
            b"\xff\xc4",
            b"\xff\xda",
            b"\xff\xdb",
            b"\xff\xdd",
            b"\xff\xd9",
            b"\xff\xee",
            b"Adobe",
            b"channels\0chlist\0",
            b"compression\0compression\0",
            b"dataWindow\0box2i\0",
            b"displayWindow\0box2i\0",
            b"lineOrder\0lineOrder\0",
            b"tiles\0tiledesc\0",
            b"comments\0string\0",
            b"chunkCount\0int\0",
            b"type\0string\0",
            b"name\0string\0",
            b"view\0string\0",
            b"scanlineimage",
            b"tiledimage",
            b"deepscanline",
            b"preview\0preview\0",
        ],
        "obj" => &[
            b"v ",
            b"vt ",
            b"vn ",
            b"f ",
            b"fo ",
            b"g ",
            b"o ",
            b"s ",
            b"l ",
            b"p ",
            b"usemtl ",
            b"mtllib ",
            b"vp ",
            b"#",
            b"\\\n",
            b"\r\n",
            b"//",
            b"nan",
            b"inf",
            b"-inf",
            b"1e38",
            b"1e-45",
            b"3.4028235e38",
            b"-1",
            b"4294967296",
            b"9223372036854775807",
            b"-9223372036854775808",
            b"1/1/1",
            b"\xff",
            b"\xe2\x80\xa8",
            b"\x0b",
            b"\xc2\xa0",
        ],
        "scene" | "material" | "bench" => &[
            b"NaN",
            b"inf",
            b"-inf",
            b"1e308",
            b"1e-308",
            b"5e-324",
            b"0x",
            b"0b1",
            b"1_0",
            b"2u8",
            b"9007199254740993",
            b"18446744073709551615",
            b"340282366920938463463374607431768211455",
            b"/*",
            b"*/",
            b"//",
            b"#![enable(",
            b"r#\"",
            b"\"#",
            b"\\u{",
            b"\\x41",
            b"Some(",
            b"None",
            b"()",
            b"(,)",
            b"\xef\xbb\xbf",
            b"\r\n",
            b"\xc2\x85",
            b"\xe2\x80\xa8",
            b"b.ron",
            b"c.ron",
            b"d.ron",
            b"a.ron",
            b"a.obj",
            b"a.png",
            b"fuzz.ron",
            b"../",
            b"true",
            b"false",
            b"scene,technique,settings,size,measure,unit,repeat,value\n",
            b",ms,1,0.5\n",
            b"\"\"",
        ],
        // Lengths, as they are written.
        _ => &[
            b"diaphane",
            b"\x80\x80",
            b"\xff\xff\xff\xff\x0f",
            b"\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01",
            b"\0\0\xc0\x7f",
        ],
    };
    let mut words: BTreeSet<Vec<u8>> = fixed.iter().map(|word| word.to_vec()).collect();
    if matches!(name, "scene" | "material" | "bench") {
        words.insert(PART.as_bytes().to_vec());
        // Every word of the files, and of what the program says of mistakes in them: all that is known here or there.
        let told = listed(&root.join("tests/problems"))
            .into_iter()
            .filter(|path| path.extension().is_some_and(|e| e == "txt"));
        let told: Vec<Vec<u8>> = told.filter_map(|path| std::fs::read(path).ok()).collect();
        for text in seeds.iter().chain(&told) {
            let letter = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
            let names =
                text.split(|byte| !letter(byte)).filter(|word| word.first().is_some_and(u8::is_ascii_alphabetic));
            words.extend(names.filter(|word| (2..=30).contains(&word.len())).map(<[u8]>::to_vec));
        }
    }
    words
}

fn listed(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the project's folders can be listed");
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.expect("it can be listed").path()).collect();
    found.sort();
    found
}

/// Scenes, materials or settings of the project, as they are and with their defaults written out. The files that they name
/// are the small ones that stand beside an input.
fn texts(root: &Path, kind: Kind) -> Vec<Vec<u8>> {
    let folders = ["scenes", "scenes/bench", "materials", "tests/problems", "tests/scenes", "tests/golden"];
    let files = folders.iter().flat_map(|folder| listed(&root.join(folder)));
    let reader = Reader::new(Default::default());
    let mut texts = BTreeSet::new();
    for file in files.filter(|file| file.extension().is_some_and(|e| e == "ron")) {
        if reader.kind_of(&file).ok() != Some(kind) {
            continue;
        }
        let own = std::fs::read_to_string(&file).ok();
        texts.extend(own.into_iter().chain(reader.defaults(&file).ok()).map(|text| beside(&text)));
    }
    let table = "scene,technique,settings,size,measure,unit,repeat,value\n\
                 a,Opaque,\"layers: 8, n: \"\"x\"\"\",32x32,frame,ms,1,0.25\n";
    let mut texts: Vec<String> = texts.into_iter().collect();
    match kind {
        Kind::Scene => {
            let set = format!("{PART}objects[0].transform.scale=2\nview.size=(8, 8)\nbookmarks[\"a\"].fov_y_deg=3");
            texts.extend(texts.first().cloned().map(|text| text + &set));
        }
        Kind::Material => {
            let based = "Material(version: 1, base: \"b.ron\", surface: (ior: 1.4))";
            let base = "Material(version: 1, base: \"c.ron\", medium: Opaque(albedo: 0.5))";
            texts.push(format!("{based}{PART}{base}{PART}{}", texts.first().cloned().unwrap_or_default()));
        }
        Kind::Bench => {
            let settings = "Bench(version: 1, techniques: [Opaque(), LongRange(layers: 8)], size: (4, 4), repetitions: 3, \
                            truths: [Volume], max_error: 0.5, max_spp: 8)";
            texts.push(format!("{settings}{PART}{table}"));
        }
    }
    texts.into_iter().map(String::into_bytes).collect()
}

/// Whatever file a text names, by the name of the small one of its kind.
fn beside(text: &str) -> String {
    let mut pieces: Vec<String> = text.split('"').map(str::to_string).collect();
    for quoted in pieces.iter_mut().skip(1).step_by(2) {
        let small = match Path::new(quoted.as_str()).extension().and_then(|e| e.to_str()) {
            Some("obj") => "a.obj",
            Some("png" | "jpg" | "hdr" | "exr") => "a.png",
            Some("ron") => "a.ron",
            _ => continue,
        };
        *quoted = small.to_string();
    }
    pieces.join("\"")
}

fn meshes(root: &Path) -> Vec<Vec<u8>> {
    let mut meshes: Vec<Vec<u8>> = [
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "# all\no a\nv 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0 0\nvt 1\nvn 0 0 1\nvn 0 0 0\ng b\n\
         usemtl c\ns off\nf 1/1/1 2/2/1 3/3/2 4//1\nf -4 -3 \\\n -2\nl 1 2\np 1\nfo 1 2 3\n",
        "v 1e30 0 0\r\nv 0 -1e30 0\r\nv 0 0 1e-30\r\nv 1 1 1\r\nf 1 2 3\r\nf 1 3 4\r\n",
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\nf 1 1 2\nf 1 2 2 3\n",
        "f 1 2 3\nv nan 0 0\n",
        "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n",
    ]
    .map(|text| text.as_bytes().to_vec())
    .into();
    let sphere = diaphane::geometry::shapes::sphere(1.0, 0);
    let mut text = String::new();
    sphere.positions.iter().for_each(|p| text += &format!("v {} {} {}\n", p.x, p.y, p.z));
    sphere
        .triangles
        .iter()
        .for_each(|[a, b, c]| text += &format!("f {0}//{0} {1}//{1} {2}//{2}\n", a + 1, b + 1, c + 1));
    sphere.normals.iter().for_each(|n| text += &format!("vn {} {} {}\n", n.x, n.y, n.z));
    meshes.push(text.into_bytes());
    meshes.extend(std::fs::read(root.join("tests/problems/parts/triangle.obj")));
    meshes
}

fn bakes() -> Vec<Vec<u8>> {
    let nothing = [0; 4];
    let some = [
        &[1, 3][..],
        &[0; 36],
        &[3],
        &[0; 36],
        &[0, 1, 0, 1, 2],
        &[1, 1, 1, 0, 1, 4, 1],
        &[0; 97],
        &[1, 1, b'a'],
        &0.5_f64.to_le_bytes(),
        &[2, 7, 8],
    ]
    .concat();
    let file = |content: &[u8]| sign(&[&[0; 67][..], content].concat());
    let (empty, full) = (file(&nothing), file(&some));
    let cut = full[..full.len() - 3].to_vec();
    vec![empty, full, cut, b"diaphane".to_vec(), Vec::new()]
}

fn images() -> Vec<Vec<u8>> {
    const SIDE: u32 = 20;
    let pixels: Vec<[f32; 3]> = (0..SIDE * SIDE).map(|i| [i as f32 / 600.0, (i % 17) as f32 / 16.0, 0.25]).collect();
    let picture = Image { width: SIDE, height: SIDE, pixels };
    let encoded = |format| picture.encode(format, Display::default(), &[("key", "value")]).expect("it can be written");
    let mut images = vec![encoded(Format::Png), encoded(Format::Exr)];
    let levels: Vec<u8> = (0..SIDE * SIDE * 8).map(|i| (i / 7) as u8).collect();
    for (color, bytes) in [
        (ExtendedColorType::L8, 1),
        (ExtendedColorType::La8, 2),
        (ExtendedColorType::Rgb8, 3),
        (ExtendedColorType::Rgba8, 4),
        (ExtendedColorType::L16, 2),
        (ExtendedColorType::Rgba16, 8),
    ] {
        let mut out = Vec::new();
        let data = &levels[..(8 * 8 * bytes) as usize];
        PngEncoder::new(&mut out).write_image(data, 8, 8, color).expect("it can be written");
        images.push(out);
    }
    for color in [ExtendedColorType::L8, ExtendedColorType::Rgb8] {
        let mut out = Vec::new();
        let data = &levels[..(SIDE * SIDE) as usize * if color == ExtendedColorType::L8 { 1 } else { 3 }];
        JpegEncoder::new(&mut out).encode(data, SIDE, SIDE, color).expect("it can be written");
        images.push(out);
    }
    let mut out = Vec::new();
    let rgb: Vec<Rgb<f32>> = picture.pixels.iter().copied().map(Rgb).collect();
    HdrEncoder::new(&mut out).encode(&rgb, SIDE as usize, SIDE as usize).expect("it can be written");
    images.push([b"#?RGBE".as_slice(), &out[b"#?RADIANCE".len()..]].concat());
    images.push(out);
    let tiles = Blocks::Tiles(Vec2(16, 16));
    for (compression, blocks) in [
        (Compression::Uncompressed, Blocks::ScanLines),
        (Compression::RLE, tiles),
        (Compression::ZIP1, Blocks::ScanLines),
        (Compression::ZIP16, tiles),
        (Compression::PIZ, Blocks::ScanLines),
        (Compression::PXR24, tiles),
        (Compression::B44, Blocks::ScanLines),
        (Compression::B44A, tiles),
    ] {
        let channels = SpecificChannels::rgba(|Vec2(x, y)| {
            let [r, g, b] = picture.at(x as u32, y as u32);
            (r, g, exr::prelude::f16::from_f32(b), x as u32)
        });
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let layer = Layer::new((SIDE as usize, SIDE as usize), LayerAttributes::default(), encoding, channels);
        let mut out = Cursor::new(Vec::new());
        Layers::from_layer(layer).write().to_buffered(&mut out).expect("it can be written");
        images.push(out.into_inner());
    }
    images
}

//! Files of models, supports and marker maps with one thing wrong.

use super::bytes;
use super::case::{Case, Class, Expectation};
use super::ground::Ground;
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// The classes.
pub fn classes() -> Vec<Class> {
    vec![
        Class::new("bytes of a model.json damaged", 100, damaged),
        Class::new("fields of a model.json odd or absent", 200, fields),
        Class::new("a model.json of another robot", 10, another_robot),
        Class::new("bytes of a model.json or of a log damaged, to predict and simulate", 150, damaged_use),
        Class::new("fields of a model.json odd or absent, to predict and simulate", 200, fields_use),
        Class::new("support files damaged or odd", 80, support),
        Class::new("marker maps damaged or odd", 80, map),
    ]
}

fn damaged(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (bytes, story) = bytes::damage(ground.file("model.json"), random);
    Case::new(ground, "held model", Expectation::Orderly, story).file("model.json", bytes)
}

/// Goes down to a value at random, and gives it with the way to it.
fn any_value<'a>(mut value: &'a mut Value, way: &mut String, random: &mut ChaCha8Rng) -> &'a mut Value {
    while !random.random_bool(0.15) {
        let size = value.as_object().map_or(0, serde_json::Map::len) + value.as_array().map_or(0, Vec::len);
        if size == 0 {
            break;
        }
        let index = random.random_range(0..size);
        if let Some(name) = value.as_object().and_then(|fields| fields.keys().nth(index).cloned()) {
            way.push_str(&format!(".{name}"));
            value = &mut value[&name];
        } else {
            way.push_str(&format!("[{index}]"));
            value = &mut value[index];
        }
    }
    value
}

fn fields(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (story, model) = odd_model(ground, random);
    Case::new(ground, "held model", Expectation::Orderly, story).file("model.json", model)
}

/// The good model with one value in it that is odd: which, and the file's text.
fn odd_model(ground: &Ground, random: &mut ChaCha8Rng) -> (String, String) {
    let mut model: Value = serde_json::from_slice(ground.file("model.json")).unwrap_or_default();
    let mut way = String::new();
    let value = any_value(&mut model, &mut way, random);
    let odd = [
        json!(null),
        json!(-1.0),
        json!(0),
        json!(1e300),
        json!(1e160),
        json!(-1e308),
        json!("x"),
        json!([]),
        json!({}),
        json!([1, 2]),
        json!(true),
        json!("\u{1b}[2J"),
        json!(1e-320),
        json!([[], []]),
    ];
    let odd = odd.choose(random).cloned().unwrap_or_default();
    let story = format!("{way} is {odd}");
    *value = odd;
    (story, model.to_string())
}

/// The commands that use a model by itself.
const USES: [&str; 2] = ["predict", "simulate"];

fn damaged_use(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (good, file) =
        (USES[random.random_range(0..2)], ["model.json", "validate.csv"][random.random_range(0..2)]);
    let (bytes, story) = bytes::damage(ground.file(file), random);
    Case::new(ground, good, Expectation::Orderly, format!("{file} of {good}: {story}")).file(file, bytes)
}

fn fields_use(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let good = USES[random.random_range(0..2)];
    let (story, model) = odd_model(ground, random);
    Case::new(ground, good, Expectation::Orderly, format!("{good}: {story}")).file("model.json", model)
}

fn another_robot(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut model: Value = serde_json::from_slice(ground.file("model.json")).unwrap_or_default();
    let joint = random.random_range(0..4);
    model["joints"][joint] = json!("another_joint");
    Case::new(ground, "held model", Expectation::Refused, format!("joint {joint} has another name"))
        .file("model.json", model.to_string())
}

fn support(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let good = "[[foot]]\nlink = \"base\"\nsole = [[0.2, 0.2, 0.0], [-0.2, 0.2, 0.0], [-0.2, -0.2, 0.0], [0.2, -0.2, 0.0]]\n";
    let odd = [
        good.replace("0.2", "nan"),
        good.replace("0.2", "inf"),
        good.replace("0.2", "0"),
        good.replace("0.2", "1e300"),
        good.replace("base", "nowhere"),
        good.replace("[-0.2, 0.2, 0.0], ", ""),
        good.repeat(20_000),
        good.replace("sole", "soul"),
        String::new(),
        "a = ".to_owned(),
        "[".repeat(100_000),
        format!("a = {}{}", "[".repeat(5000), "]".repeat(5000)),
        "a.".repeat(50_000),
    ];
    let (bytes, story) = if random.random_bool(0.5) {
        let index = random.random_range(0..odd.len());
        (odd[index].clone().into_bytes(), format!("odd support {index}"))
    } else {
        bytes::damage(good.as_bytes(), random)
    };
    let mut case = Case::new(ground, "next", Expectation::Orderly, story).file("support.toml", bytes);
    case.words.extend(["--support".to_owned(), "support.toml".to_owned()]);
    case
}

fn map(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let good = "name = \"mine\"\nmarker_spread_m = 0.01\n[[marker]]\nlabel = \"STRN\"\nsegment = \"torso\"\nposition_m = [0.1, 0.0, 0.2]\n";
    let odd = [
        good.replace("0.01", "-1.0"),
        good.replace("0.01", "nan"),
        good.replace("torso", "tail"),
        good.repeat(2),
        "x".repeat(2 << 20),
        String::new(),
        "[".repeat(100_000),
    ];
    let (bytes, story) = if random.random_bool(0.5) {
        let index = random.random_range(0..odd.len());
        (odd[index].clone().into_bytes(), format!("odd map {index}"))
    } else {
        bytes::damage(good.as_bytes(), random)
    };
    let mut case = Case::new(ground, "retarget", Expectation::Orderly, story).file("map.toml", bytes);
    case.words.extend(["--map".to_owned(), "map.toml".to_owned()]);
    case
}

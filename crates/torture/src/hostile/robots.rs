//! URDFs with one thing wrong.

use super::bytes;
use super::case::{Case, Class, Expectation};
use super::ground::Ground;
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// The classes.
pub fn classes() -> Vec<Class> {
    vec![
        Class::new("bytes of a URDF damaged", 250, damaged),
        Class::new("another kind of file for a URDF", 60, another_kind),
        Class::new("a URDF nested deep", 20, nested),
        Class::new("a URDF with many attributes, elements or entities", 40, many),
        Class::new("many joints", 12, many_joints),
        Class::new("attributes with odd values", 200, odd_values),
        Class::new("links and joints that do not fit together", 100, topology),
        Class::new("names with control characters", 60, names),
        Class::wrong("what a fit does not need is odd", 60, unneeded),
        Class::wrong("bodies that cannot exist", 40, impossible_bodies),
    ]
}

fn urdf(ground: &Ground, expectation: Expectation, story: String, text: impl Into<Vec<u8>>) -> Case {
    Case::new(ground, "identify", expectation, story).file("robot.urdf", text)
}

/// The good URDF with `more` before its end.
fn with(ground: &Ground, more: &str) -> String {
    ground.text("robot.urdf").replace("</robot>", &format!("{more}</robot>"))
}

fn damaged(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (bytes, story) = bytes::damage(ground.file("robot.urdf"), random);
    urdf(ground, Expectation::Orderly, story, bytes)
}

fn another_kind(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (bytes, story) = bytes::another_kind(random);
    urdf(ground, Expectation::Refused, story, bytes)
}

fn nested(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let depth = random.random_range(100..200_000);
    let name = *["a", "link", "joint", "visual", "inertial"].choose(random).unwrap_or(&"a");
    let closed = random.random_bool(0.5);
    let mut more = format!("<{name}>").repeat(depth);
    if closed {
        more += &format!("</{name}>").repeat(depth);
    }
    urdf(
        ground,
        Expectation::Refused,
        format!("{depth} times <{name}>, closed: {closed}"),
        with(ground, &more),
    )
}

fn many(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let count = random.random_range(100..250_000_usize);
    let (story, text) = match random.random_range(0..5) {
        0 => {
            let attributes: String = (0..count).map(|number| format!(" a{number}=\"\"")).collect();
            (format!("{count} attributes"), with(ground, &format!("<a{attributes}/>")))
        }
        1 => {
            let links: String = (0..count).map(|number| format!("<link name=\"n{number}\"/>")).collect();
            (format!("{count} loose links"), with(ground, &links))
        }
        2 => {
            let head = format!("<!DOCTYPE robot [<!ENTITY e \"{}\">]>", "x".repeat(100_000));
            (
                format!("{count} entities of 100 kB"),
                head + &with(ground, &format!("<a>{}</a>", "&e;".repeat(count))),
            )
        }
        3 => {
            let laughs: String = (1..12)
                .map(|n| format!("<!ENTITY l{n} \"{}\">", format!("&l{};", n - 1).repeat(10)))
                .collect();
            let head = format!("<!DOCTYPE robot [<!ENTITY l0 \"ha\">{laughs}]>");
            ("a billion laughs".to_owned(), head + &with(ground, "<a>&l11;</a>"))
        }
        _ => {
            let name = "n".repeat(count * 40);
            (format!("a name of {} bytes", name.len()), with(ground, &format!("<link name=\"{name}\"/>")))
        }
    };
    urdf(ground, Expectation::Refused, story, text)
}

fn many_joints(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let count = random.random_range(100..600);
    let mut text = "<robot name=\"chain\"><link name=\"l0\"/>".to_owned();
    let mut header = "t".to_owned();
    for number in 1..=count {
        text += &format!(
            "<link name=\"l{number}\"><inertial><mass value=\"1\"/><origin xyz=\"0 0.1 0.1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"j{number}\" type=\"continuous\"><parent link=\"l{}\"/><child link=\"l{number}\"/><origin xyz=\"0.1 0 0.1\" rpy=\"0.3 0 0\"/><axis xyz=\"0 0 1\"/></joint>",
            number - 1
        );
        header += &format!(",q.j{number},tau.j{number}");
    }
    let row = |row: i32| {
        format!(
            "{}{}\n",
            0.01 * f64::from(row),
            format!(",{},1", (0.01 * f64::from(row)).sin()).repeat(count)
        )
    };
    let log = header + "\n" + &(0..200).map(row).collect::<String>();
    let case = urdf(ground, Expectation::Refused, format!("{count} joints"), text + "</robot>");
    case.file("train.csv", log.clone()).file("validate.csv", log)
}

/// The places of quoted values that follow ` name="`.
fn values(text: &str, name: &str) -> Vec<std::ops::Range<usize>> {
    let key = format!("{name}=\"");
    let starts = text.match_indices(&key).map(|(at, _)| at + key.len());
    starts.filter_map(|start| text[start..].find('"').map(|length| start..start + length)).collect()
}

fn odd_values(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    const NAMES: [&str; 17] = [
        "xyz", "rpy", "value", "ixx", "iyy", "izz", "ixy", "ixz", "iyz", "lower", "upper", "effort",
        "velocity", "link", "name", "type", "mass",
    ];
    const VALUES: [&str; 18] = [
        "",
        " ",
        "nan",
        "inf",
        "-inf",
        "1e400",
        "1e308",
        "-1",
        "0",
        "0 0 0",
        "1 2",
        "1 2 3 4",
        "a b c",
        "1,0,0",
        "1e-320 0 0",
        "1e200 1e200 1e200",
        "\u{1b}[31m",
        "0x10",
    ];
    let mut text = ground.text("robot.urdf");
    let name = *NAMES.choose(random).unwrap_or(&"xyz");
    let value = *VALUES.choose(random).unwrap_or(&"");
    let Some(place) = values(&text, name).choose(random).cloned() else {
        return urdf(ground, Expectation::Same, format!("no {name}"), text);
    };
    let story = format!("{name}=\"{}\" in the place of \"{}\"", value.escape_debug(), &text[place.clone()]);
    text.replace_range(place, value);
    urdf(ground, Expectation::Orderly, story, text)
}

fn topology(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut text = ground.text("robot.urdf");
    let links = values(&text, "link");
    let [one, other] = [links.choose(random).cloned(), links.choose(random).cloned()];
    let (Some(one), Some(other)) = (one, other) else {
        return urdf(ground, Expectation::Same, "no links".to_owned(), text);
    };
    let story = match random.random_range(0..4) {
        0 => {
            let name = text[other].to_owned();
            let story = format!("a joint's link `{}` is `{name}`", &text[one.clone()]);
            text.replace_range(one, &name);
            story
        }
        1 => {
            text.replace_range(one, "nowhere");
            "a joint's link is nowhere".to_owned()
        }
        2 => {
            let joints: Vec<_> = text.match_indices("<joint").map(|(at, _)| at).collect();
            let at = joints.choose(random).copied().unwrap_or_default();
            let end = text[at..].find("</joint>").map_or(text.len(), |length| at + length + 8);
            let joint = text[at..end].to_owned();
            text.insert_str(end, &joint);
            "a joint twice".to_owned()
        }
        _ => {
            let mimic = "<mimic joint=\"joint_1\" multiplier=\"nan\"/></joint>";
            text = text.replacen("</joint>", mimic, random.random_range(1..3));
            "joints that follow each other".to_owned()
        }
    };
    urdf(ground, Expectation::Orderly, story, text)
}

fn names(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    const ODD: [&str; 6] = ["&#x1b;[2J", "\u{202e}txt", "a&#10;b", "&#x9;", "\u{200b}", "a,b"];
    let mut text = ground.text("robot.urdf");
    let odd = *ODD.choose(random).unwrap_or(&ODD[0]);
    let Some(place) = values(&text, "name").choose(random).cloned() else {
        return urdf(ground, Expectation::Same, "no names".to_owned(), text);
    };
    let old = text[place.clone()].to_owned();
    if random.random_bool(0.5) {
        text = text.replace(&format!("\"{old}\""), &format!("\"{odd}\""));
    } else {
        text.replace_range(place, odd);
    }
    urdf(ground, Expectation::Orderly, format!("`{}` in the place of `{old}`", odd.escape_debug()), text)
}

fn unneeded(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    const ODD: [&str; 7] = [
        "<visual><geometry/></visual>",
        "<visual><origin xyz=\"a b\"/><geometry><mesh filename=\"package://none/x.dae\"/></geometry></visual>",
        "<collision><geometry><box size=\"\"/></geometry></collision>",
        "<collision/>",
        "<visual><material name=\"\"><color rgba=\"1\"/></material></visual>",
        "<sensor type=\"x\"><camera/></sensor>",
        "<contact><lateral_friction value=\"\"/></contact>",
    ];
    let odd = *ODD.choose(random).unwrap_or(&ODD[0]);
    let text =
        ground.text("robot.urdf").replacen("</link>", &format!("{odd}</link>"), random.random_range(1..5));
    let outside = [
        "",
        "<transmission name=\"t\"><type/></transmission>",
        "<gazebo reference=\"none\"><a/></gazebo>",
        "<material name=\"m\"/>",
    ];
    let outside = *outside.choose(random).unwrap_or(&"");
    let text = text.replace("</robot>", &format!("{outside}</robot>"));
    urdf(ground, Expectation::Same, format!("{odd} {outside}"), text)
}

fn impossible_bodies(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut text = ground.text("robot.urdf");
    let (name, value) = *[("ixx", "-1"), ("value", "-5"), ("value", "0"), ("ixy", "50"), ("izz", "0")]
        .choose(random)
        .unwrap_or(&("ixx", "-1"));
    let Some(place) = values(&text, name).choose(random).cloned() else {
        return urdf(ground, Expectation::Same, format!("no {name}"), text);
    };
    text.replace_range(place, value);
    // The inertial values of the URDF do not enter a fit.
    urdf(ground, Expectation::SameOrSaid, format!("{name}=\"{value}\""), text)
}

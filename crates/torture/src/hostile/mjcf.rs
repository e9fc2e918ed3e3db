//! MJCF in the place of the URDF: the same robot in other words, and with one thing wrong.

use super::bytes;
use super::case::{Case, Class, Expectation};
use super::ground::Ground;
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// The classes.
pub fn classes() -> Vec<Class> {
    vec![
        Class::wrong("a robot as MJCF in other words", 60, other_words),
        Class::wrong("what a fit does not need is odd in an MJCF", 60, unneeded),
        Class::new("bytes of an MJCF damaged", 150, damaged),
        Class::new("attributes of an MJCF with odd values", 150, odd_values),
        Class::new("an MJCF that is not read", 80, not_read),
    ]
}

/// The robot of the ground, as somebody writes it for MuJoCo.
const SCARA: &str = r#"<mujoco model="scara4">
  <compiler angle="radian" autolimits="true"/>
  <default><joint axis="0 0 1"/><default class="slide"><joint type="slide"/></default></default>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="link_1" pos="0 0 0.4">
      <inertial pos="0.17 0.006 -0.02" mass="9.4" diaginertia="0.02303 0.13685 0.13685"/>
      <joint name="joint_1" range="-2.4 2.4"/>
      <geom type="capsule" size="0.05" fromto="0 0 0 0.35 0 0"/>
      <body name="link_2" pos="0.35 0 0.05">
        <inertial pos="0.14 -0.009 0.04" mass="6.8" diaginertia="0.01224 0.075537 0.075537"/>
        <joint name="joint_2" range="-2.5 2.5"/>
        <geom type="box" size="0.15 0.05 0.04" pos="0.15 0 0"/>
        <body name="link_3" pos="0.3 0 0.1">
          <inertial pos="0.002 0.001 -0.05" mass="1.9" diaginertia="0.019464 0.019464 0.0001368"/>
          <joint name="joint_3" class="slide" range="-0.2 0.05"/>
          <body name="link_4" pos="0 0 -0.2">
            <inertial pos="0.024 0.015 -0.03" mass="1.3" diaginertia="0.0031 0.0036 0.0029"/>
            <joint name="joint_4" range="-3.1 3.1"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"#;

fn case(ground: &Ground, expectation: Expectation, story: String, text: impl Into<Vec<u8>>) -> Case {
    Case::new(ground, "identify", expectation, story).file("robot.urdf", text)
}

/// What stands in the root element.
fn inside(text: &str) -> &str {
    let start = text.find('>').map_or(0, |at| at + 1);
    &text[start..text.find("</mujoco>").unwrap_or(text.len())]
}

fn other_words(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut text = SCARA.to_owned();
    let mut files: Vec<(&str, String)> = Vec::new();
    let story = match random.random_range(0..6) {
        0 => {
            for (radians, degrees) in
                [("-2.4 2.4", "-137.5 137.5"), ("-2.5 2.5", "-143 143"), ("-3.1 3.1", "-177 177")]
            {
                text = text.replace(radians, degrees);
            }
            text = text.replace(" angle=\"radian\"", "");
            "degrees"
        }
        1 => {
            files.push(("parts/all.xml", format!("<mujocoinclude>{}</mujocoinclude>", inside(&text))));
            text = "<mujoco model=\"scara4\"><include file=\"parts/all.xml\"/></mujoco>".to_owned();
            "all of it included"
        }
        2 => {
            let start = text.find("<body name=\"link_2\"").unwrap_or_default();
            let end = text.rfind("</body>\n  </worldbody>").unwrap_or(text.len());
            files.push((
                "arm.xml",
                format!("<mujoco><include file=\"more.xml\"/>{}</mujoco>", &text[start..end]),
            ));
            files.push(("more.xml", "<mujocoinclude><!-- nothing --></mujocoinclude>".to_owned()));
            text.replace_range(start..end, "<include file=\"arm.xml\"/>");
            "an arm included, which includes something"
        }
        3 => {
            text = text.replace(
                "<body name=\"link_3\" pos=\"0.3 0 0.1\">",
                "<frame pos=\"0.3 0 0\"><body name=\"link_3\" pos=\"0 0 0.1\">",
            );
            text = text.replacen(
                "</body>\n        </body>\n      </body>",
                "</body>\n        </body></frame>\n      </body>",
                1,
            );
            "a body in a frame"
        }
        4 => {
            text = text
                .replace(" axis=\"0 0 1\"", " axis=\"0 0 7\"")
                .replace("<default class=\"slide\">", "<default class=\"slide\"><geom rgba=\"1 0 0 1\"/>");
            "axes of another length"
        }
        _ => {
            text = format!("\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- <robot> -->\n{text}");
            "a byte order mark, a declaration and a comment"
        }
    };
    let case = case(ground, Expectation::Same, story.to_owned(), text);
    files.into_iter().fold(case, |case, (name, content)| case.file(name, content))
}

fn unneeded(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    const BESIDE: [&str; 9] = [
        "<asset><mesh name=\"m\" file=\"nowhere.stl\"/><texture file=\"nowhere.png\"/></asset>",
        "<asset><mesh file=\"package://a/b.dae\" scale=\"1 1 1\"/></asset>",
        "<sensor><jointpos joint=\"nobody\"/></sensor>",
        "<keyframe><key qpos=\"1 2 3\"/></keyframe>",
        "<visual><global offwidth=\"-1\"/></visual>",
        "<statistic extent=\"0\"/>",
        "<contact><exclude body1=\"x\" body2=\"y\"/></contact>",
        "<custom><numeric name=\"n\" data=\"\"/></custom>",
        "<size nconmax=\"-5\"/>",
    ];
    const WITHIN: [&str; 5] = [
        "<geom type=\"mesh\" mesh=\"nobody\"/>",
        "<geom type=\"capsule\" size=\"-1\"/>",
        "<site name=\"s\" pos=\"a b c\"/>",
        "<camera name=\"c\" fovy=\"900\"/>",
        "<geom type=\"box\" size=\"\"/>",
    ];
    let (beside, within) = (*BESIDE.choose(random).unwrap_or(&""), *WITHIN.choose(random).unwrap_or(&""));
    let body = format!("<joint name=\"joint_{}\"", random.random_range(1..5));
    let text =
        SCARA.replace("</mujoco>", &format!("{beside}</mujoco>")).replace(&body, &format!("{within}{body}"));
    case(ground, Expectation::Same, format!("{beside} {within}"), text)
}

fn damaged(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (bytes, story) = bytes::damage(SCARA.as_bytes(), random);
    case(ground, Expectation::Orderly, story, bytes)
}

fn odd_values(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    const VALUES: [&str; 16] = [
        "",
        " ",
        "nan",
        "inf",
        "1e400",
        "1e308",
        "1e200 1e200 1e200",
        "-1",
        "0",
        "0 0 0",
        "1 2",
        "1 2 3 4",
        "a b c",
        "\u{1b}[31m",
        "true",
        "0x10",
    ];
    let value = *VALUES.choose(random).unwrap_or(&"");
    let places: Vec<(usize, &str)> = SCARA.match_indices("=\"").collect();
    let at = places.choose(random).map_or(0, |place| place.0 + 2);
    let end = SCARA[at..].find('"').map_or(SCARA.len(), |length| at + length);
    let story = format!("\"{}\" in the place of \"{}\"", value.escape_debug(), &SCARA[at..end]);
    let mut text = SCARA.to_owned();
    text.replace_range(at..end, value);
    case(ground, Expectation::Orderly, story, text)
}

fn not_read(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let before_end = |more: &str| SCARA.replace("</mujoco>", &format!("{more}</mujoco>"));
    let in_link =
        |more: &str| SCARA.replace("<joint name=\"joint_2\"", &format!("{more}<joint name=\"joint_2\""));
    let mut files: Vec<(&str, Vec<u8>)> = Vec::new();
    let (story, text) = match random.random_range(0..12) {
        0 => ("an included file that is not there", before_end("<include file=\"none.xml\"/>")),
        1 => {
            files.push(("loop.xml", b"<mujocoinclude><include file=\"loop.xml\"/></mujocoinclude>".to_vec()));
            ("a file that includes itself", before_end("<include file=\"loop.xml\"/>"))
        }
        2 => {
            files.push(("a.xml", b"<mujoco><include file=\"b.xml\"/></mujoco>".to_vec()));
            files.push(("b.xml", b"<mujoco><include file=\"a.xml\"/></mujoco>".to_vec()));
            ("two files that include each other", before_end("<include file=\"a.xml\"/>"))
        }
        3 => {
            files.push(("a.xml", b"<robot name=\"r\"/>".to_vec()));
            ("a URDF that is included", before_end("<include file=\"a.xml\"/>"))
        }
        4 => {
            files.push(("a.xml", vec![0xff; random.random_range(0..5000)]));
            ("bytes that are included", before_end("<include file=\"a.xml\"/>"))
        }
        5 => ("a folder that is included", before_end("<include file=\".\"/>")),
        6 => ("an include without a file", before_end("<include/>")),
        7 => ("a ball joint", in_link("<joint type=\"ball\"/>")),
        8 => ("bodies by a rule", in_link("<replicate count=\"3\"><body/></replicate>")),
        9 => ("two joints of one name", in_link("<joint name=\"joint_1\"/>")),
        10 => ("a class that is nowhere", in_link("<joint class=\"nowhere\"/>")),
        _ => {
            let depth = random.random_range(100..100_000);
            ("nested deep", before_end(&"<body>".repeat(depth)))
        }
    };
    let case = case(ground, Expectation::Refused, story.to_owned(), text);
    files.into_iter().fold(case, |case, (name, content)| case.file(name, content))
}

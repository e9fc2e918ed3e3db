//! The page stands alone, closes what it opens, and takes no text for markup.

use phiw_report::IdentificationPage;
use phiw_report::json::Verdict;
use phiw_report::page::*;
use phiw_report::plot::*;

const HOSTILE: &str = "torso/joint_1<script>alert(\"1\")</script>&'";

fn word() -> String {
    HOSTILE.to_owned()
}

fn words() -> Vec<String> {
    vec![word(), word()]
}

fn line(number: f64, samples: usize) -> Polyline {
    Polyline {
        x: (0..samples).map(|i| 0.01 * i as f64).collect(),
        y: (0..samples).map(|i| number + (0.37 * i as f64).sin()).collect(),
    }
}

fn picture(before: Polyline) -> Picture {
    let plot = ResidualAgainstSignal {
        signal: HOSTILE,
        residual: HOSTILE,
        before: Line::from(&before),
        after: Line::default(),
    };
    Picture { caption: word(), svg: residual_against_signal(&plot) }
}

fn candidates(number: f64) -> Vec<CandidateRow> {
    vec![CandidateRow { kind: word(), joints: words(), held_out: number, parameters: 2, note: word() }; 9]
}

fn effect(number: f64, samples: usize) -> EffectSection {
    let parameter =
        EffectParameterRow { joint: word(), name: word(), value: number, std: number, unit: word() };
    EffectSection {
        kind: word(),
        joints: words(),
        sentence: word(),
        parameters: vec![parameter],
        relative_before: number,
        relative_after: number,
        explains: number,
        confidence: number,
        stability: number,
        rivals: vec![Rival { kind: word(), joints: words(), confidence: number, separated_by: word() }],
        candidates: candidates(number),
        pictures: vec![picture(line(number, samples))],
    }
}

/// A page with every section, whose every word is hostile and every number as given.
fn page(number: f64, joints: usize, samples: usize) -> IdentificationPage {
    let line = || line(number, samples);
    let trace = || TorqueTrace { log: word(), measured: line(), predicted: line(), residual: line() };
    let picture = || picture(line());
    let candidates = candidates(number);
    let row = ErrorRow {
        joint: word(),
        unit: word(),
        rms_torque: number,
        train: Some(number),
        held_out: Some(number),
        before: Some(number),
        noise_floor: Some(number),
    };
    let joint = JointSection {
        joint: word(),
        unit: word(),
        summary: word(),
        noise_floor: Some(number),
        held_out: vec![trace()],
        train: vec![trace()],
    };
    IdentificationPage {
        robot: word(),
        inputs: vec![InputFile { role: word(), name: word(), content: word() }],
        date: word(),
        headline: words(),
        verdict: Some(Verdict::Unexplained),
        warnings: words(),
        errors: ErrorTable {
            rows: vec![row; joints],
            pooled: PooledError { train: Some(number), held_out: Some(number), before: Some(number) },
            note: word(),
        },
        effects: vec![effect(number, samples); 2],
        remaining: Some(Remaining {
            structured: true,
            joints: words(),
            depends_on: words(),
            description: words(),
            candidates,
            pictures: vec![picture()],
            unidentifiable: vec![UnidentifiableEffect {
                kind: word(),
                joints: words(),
                telling_motion: word(),
            }],
        }),
        joints: vec![joint; joints],
        reproduction: vec![picture()],
        conditioning: ConditioningSection { entries: vec![(word(), word())], pictures: vec![picture()] },
        parameters: ParametersSection {
            rows: vec![ParameterRow { name: word(), value: number, std: number, unit: word() }; 14 * joints],
            note: word(),
        },
        base_parameters: vec![BaseParameter { name: word(), regroups: HOSTILE.repeat(5) }; 3],
        told: ToldSection {
            note: word(),
            told: words(),
            sums: vec![word(); 20],
            not_told: words(),
            motions: words(),
        },
        not_identified: words(),
        urdf_findings: words(),
        version: word(),
        command_line: word(),
    }
}

/// Fails unless every element is closed in order.
fn check_balanced(html: &str) {
    const VOID: [&str; 2] = ["meta", "!DOCTYPE"];
    let mut open: Vec<&str> = Vec::new();
    for tag in html.split('<').skip(1) {
        let inside = tag.split('>').next().unwrap();
        let name = inside.split([' ', '/', '\n']).find(|name| !name.is_empty()).unwrap();
        if inside.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "closed out of order");
        } else if !inside.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
}

/// Fails if the page would load anything.
fn check_self_contained(html: &str) {
    for loads in ["http", "src=", "url(", "@import", "<script", "<link", "<iframe", "<object", "xlink"] {
        assert!(!html.contains(loads), "the page has {loads:?}");
    }
    for link in html.split("href=\"").skip(1) {
        assert!(link.starts_with('#'), "a link leads outside: {}", &link[..20]);
    }
}

#[test]
fn every_page_is_balanced_escaped_and_self_contained() {
    let pages =
        [0.0, 1.0, -3.5, 1e279, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE].map(|number| page(number, 3, 50));
    for page in pages.iter().chain([&IdentificationPage::default(), &page(1.0, 0, 0), &page(1.0, 1, 1)]) {
        let html = page.render();
        check_balanced(&html);
        check_self_contained(&html);
        assert!(!html.contains("NaN"), "a number that is none is shown");
    }
}

/// The page of an experiment holds to the same.
fn experiment() -> ExperimentPage {
    let picture = || {
        let values = [3.0, 2.0, f64::NAN];
        let lines = [IterationLine { name: HOSTILE, values: &values }];
        let plot =
            Iterations { lines: &lines, x_label: HOSTILE, y_label: HOSTILE, first: 0, logarithmic: true };
        Picture { caption: HOSTILE.to_owned(), svg: iterations(&plot) }
    };
    let table = Table { head: vec![word(), word()], rows: vec![vec![word(), "1.5 %".to_owned()]] };
    let section = Section {
        title: word(),
        sentences: vec![word()],
        table,
        pictures: vec![picture()],
        small: vec![picture(), picture()],
        notes: vec![word()],
    };
    ExperimentPage {
        title: word(),
        date: word(),
        headline: vec![word(), word()],
        inputs: vec![[word(), word()]],
        sections: vec![section.clone(), Section::default(), section],
        version: word(),
        command_line: word(),
    }
}

#[test]
fn the_page_of_an_experiment_is_balanced_escaped_and_self_contained() {
    for page in [experiment(), ExperimentPage::default()] {
        let html = page.render();
        check_balanced(&html);
        check_self_contained(&html);
    }
    let html = experiment().render();
    assert!(html.contains("<td class=\"number\">1.5 %</td>"), "numbers stand at the right");
    assert!(!ExperimentPage::default().render().contains("<table"), "what is empty does not appear");
}

#[test]
fn links_lead_somewhere() {
    let html = page(1.0, 3, 50).render() + &experiment().render();
    let links: Vec<&str> =
        html.split("href=\"#").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert!(links.contains(&"joint-1") && links.contains(&"effects"));
    for link in links {
        assert!(html.contains(&format!(" id=\"{link}\"")), "{link}");
    }
}

#[test]
fn what_is_absent_does_not_appear() {
    let has = |page: &IdentificationPage, id: &str| page.render().contains(&format!("id=\"{id}\""));
    let whole = page(1.0, 2, 50);
    let sections = [
        "errors",
        "effects",
        "remaining",
        "torques",
        "reproduction",
        "conditioning",
        "parameters",
        "base-parameters",
        "not-identified",
        "urdf",
    ];
    for section in sections {
        assert!(has(&whole, section), "{section}");
        assert!(!has(&IdentificationPage::default(), section), "{section}");
    }
    assert!(whole.render().contains("class=\"badge"));
    assert!(!IdentificationPage::default().render().contains("class=\"badge"));
}

#[test]
fn long_logs_and_many_of_them_make_small_pages() {
    for (joints, megabytes) in [(6, 1.5), (18, 4.0)] {
        for logs in [1, 24] {
            let mut page = page(1.0, joints, 40_000);
            for joint in &mut page.joints {
                joint.train = vec![joint.train[0].clone(); logs];
            }
            let bytes = page.render().len();
            assert!((bytes as f64) < megabytes * 1e6, "{joints} joints, {logs} logs: {bytes} bytes");
        }
    }
}

#[test]
fn parameters_are_sorted_and_the_poor_ones_marked() {
    let row = |name: &str, std: f64| ParameterRow { name: name.into(), value: 2.0, std, unit: "kg".into() };
    let parameters = ParametersSection {
        rows: vec![row("unknown", f64::NAN), row("poor", 1.0), row("good", 0.02), row("fair", 0.4)],
        note: String::new(),
    };
    let html = IdentificationPage { parameters, ..Default::default() }.render();
    let place = |name: &str| html.find(&format!("<td>{name}</td>")).unwrap();
    let order = ["good", "fair", "poor", "unknown"].map(place);
    assert!(order.is_sorted());
    let first_poor = html.find("class=\"poor\"").unwrap();
    assert!(order[1] < first_poor && first_poor < order[2]);
    assert!(html.contains("2 with a standard deviation below 30 %"));
}

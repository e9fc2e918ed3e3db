//! The command line of `phiw identify`, which takes logs, or a plan and factors.

use crate::arguments::SessionArguments;
use crate::fleet::MergeArguments;
use clap::error::Error as ClapError;
use clap::{Arg, ArgAction, ArgMatches, Args, FromArgMatches, value_parser};
use std::path::PathBuf;

/// Arguments of `phiw identify`: a session on logs, or the plan of one and the factors of its logs.
#[derive(Debug)]
pub struct IdentifyArguments {
    /// Robot, logs and declared model; with a plan, only where the results go.
    pub session: SessionArguments,
    /// A plan and factors in the place of robot and logs.
    pub merge: Option<MergeArguments>,
}

impl Args for IdentifyArguments {
    fn augment_args(command: clap::Command) -> clap::Command {
        let paths = |name: &'static str| Arg::new(name).long(name).value_parser(value_parser!(PathBuf));
        let elsewhere = [
            "urdf",
            "train",
            "validate",
            "declare",
            "hold",
            "mass",
            "total_mass",
            "inside",
            "inside_geometry",
            "mirrored",
            "motions",
            "cutoff_hz",
            "map",
            "parallel_cutoff_hz",
        ];
        SessionArguments::augment_args(command)
            .mut_arg("urdf", |urdf| urdf.required(false).required_unless_present("plan"))
            .mut_arg("train", |train| train.required(false).required_unless_present("plan"))
            .arg(
                paths("plan")
                    .value_name("PLAN.json")
                    .requires("factors")
                    .conflicts_with_all(elsewhere)
                    .help("A plan of `phiw plan` instead of robot and logs, which it names"),
            )
            .arg(
                paths("factors")
                    .value_name("SHARD.factor")
                    .num_args(1..)
                    .action(ArgAction::Append)
                    .requires("plan")
                    .help("The factors of all logs of the plan, as `phiw reduce` has written them"),
            )
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for IdentifyArguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, ClapError> {
        let Some(plan) = matches.get_one::<PathBuf>("plan") else {
            return Ok(IdentifyArguments {
                session: SessionArguments::from_arg_matches(matches)?,
                merge: None,
            });
        };
        let factors = matches.get_many("factors").map(|paths| paths.cloned().collect()).unwrap_or_default();
        let out: PathBuf = matches.get_one("out").cloned().unwrap_or_default();
        let session =
            SessionArguments { out: out.clone(), quiet: matches.get_flag("quiet"), ..Default::default() };
        Ok(IdentifyArguments { session, merge: Some(MergeArguments { plan: plan.clone(), factors, out }) })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), ClapError> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::arguments::{Arguments, Command};
    use clap::Parser;
    use std::path::PathBuf;

    #[test]
    fn a_plan_takes_the_place_of_robot_and_logs() {
        let plan =
            ["phiw", "identify", "--plan", "p.json", "--factors", "a.factor", "b.factor", "--out", "o"];
        let Command::Identify(read) = Arguments::try_parse_from(plan).unwrap().command else {
            panic!("`identify` is read as another command");
        };
        let merge = read.merge.unwrap();
        assert_eq!(merge.factors, ["a.factor", "b.factor"].map(PathBuf::from));
        assert_eq!((merge.plan, merge.out), ("p.json".into(), "o".into()));
        for wrong in [&["--urdf", "r.urdf"][..], &["--train", "a.csv"], &["--declare", "viscous_friction"]] {
            assert!(Arguments::try_parse_from(plan.iter().chain(wrong)).is_err(), "{wrong:?}");
        }
        assert!(Arguments::try_parse_from(["phiw", "identify", "--plan", "p.json", "--out", "o"]).is_err());
        assert!(Arguments::try_parse_from(["phiw", "identify", "--train", "a.csv", "--out", "o"]).is_err());
    }
}

//! Spoiled inputs: a good input, one thing wrong with it, and what has to come of it.

mod bytes;
mod case;
mod ground;
mod logs;
mod mjcf;
mod model_files;
mod motions;
mod recordings;
mod robots;
mod score;
mod surroundings;
mod table;
mod trial;

pub use case::{Case, Class, Expectation};
pub use ground::{Ground, GroundError};
pub use score::{ClassScore, Failure, run};
pub use trial::{Judgement, Trial};

/// All classes, in the order in which the table names them.
pub fn classes() -> Vec<Class> {
    [
        logs::classes(),
        robots::classes(),
        mjcf::classes(),
        recordings::classes(),
        motions::classes(),
        model_files::classes(),
        surroundings::classes(),
    ]
    .concat()
}

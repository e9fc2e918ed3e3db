//! Everything that has ever broken the command `phiw`, as classes of inputs that are made from a seed.
//!
//! The functions run a release binary as a user would and judge what it did: they know the program by its
//! command line, its files and its exit status alone.

pub mod hostile;
pub mod interrupted;

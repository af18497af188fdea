//! What the program does with input that is wrong, thin, huge or strange.
//!
//! Every refusal is checked for its exit code, for a message that says where, what and what to do, for an empty
//! standard output, and for leaving no file behind.

mod command_line;
mod configurations;
mod markers;
mod paths;
mod place;
mod recordings;
mod results;
mod simulations;
mod undecided;

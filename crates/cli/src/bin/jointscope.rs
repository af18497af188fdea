//! The jointscope program.

fn main() -> std::process::ExitCode {
    jointscope_cli::main()
}

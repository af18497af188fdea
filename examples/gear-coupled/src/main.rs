use gear_coupled as _; // links the crate; without this line its model is missing

fn main() -> std::process::ExitCode {
    jointscope_cli::main()
}

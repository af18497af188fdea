// W1 registrations with Eigen's umeyama. Reads reference.f64 and frames.f64 from the folder given; see ratios/peer.rs.
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <ctime>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

using Points = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>;

static std::vector<double> numbers(const std::string &path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    std::vector<double> values(static_cast<std::size_t>(file.tellg()) / sizeof(double));
    file.seekg(0);
    file.read(reinterpret_cast<char *>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(double)));
    return values;
}

int main(int, char **arguments) {
    const std::string folder = arguments[1];
    const auto reference = numbers(folder + "/reference.f64");
    const auto frames = numbers(folder + "/frames.f64");
    const Eigen::Index features = static_cast<Eigen::Index>(reference.size() / 3);
    const std::size_t count = frames.size() / reference.size();
    const Points shape(reference.data(), 3, features);
    std::vector<Eigen::Matrix4d> found(count);
    std::cout.precision(17);
    std::cout << "ready" << std::endl;
    for (std::string line; std::getline(std::cin, line);) {
        const std::clock_t start = std::clock();
        for (std::size_t frame = 0; frame < count; ++frame)
            found[frame] = Eigen::umeyama(shape, Points(frames.data() + frame * reference.size(), 3, features), false);
        const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        std::cout << seconds / static_cast<double>(count);
        for (std::size_t frame = 0; frame < 1000; frame += 97)
            for (int row = 0; row < 3; ++row)
                for (int column = 0; column < 3; ++column) std::cout << ' ' << found[frame](row, column);
        std::cout << std::endl;
    }
}

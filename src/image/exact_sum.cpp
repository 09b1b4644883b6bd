#include "pathscope/image/exact_sum.hpp"

#include <algorithm>

namespace pathscope {

Quantum quantum_for(float typical_radiance, float brightest_radiance) {
    CHECK(std::isfinite(typical_radiance) && typical_radiance >= 0, typical_radiance);
    CHECK(std::isfinite(brightest_radiance) && brightest_radiance >= 0, brightest_radiance);
    if (typical_radiance == 0 && brightest_radiance == 0) typical_radiance = 1;

    const double step = std::max(double(typical_radiance) * 0x1p-32, double(brightest_radiance) * 0x1p-40);
    int exponent = 0;
    const double mantissa =
        std::frexp(step, &exponent);  // step = mantissa * 2^exponent, mantissa in [0.5, 1)
    const Quantum quantum{mantissa == 0.5 ? exponent - 1 : exponent};
    CHECK(quantum.valid(), quantum.exponent);
    return quantum;
}

}  // namespace pathscope

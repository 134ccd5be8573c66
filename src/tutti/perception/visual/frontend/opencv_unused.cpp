// SPDX-License-Identifier: BSD-3-Clause
// For programs with OpenCV's static libraries inside: what these name, and nothing here uses. OpenGL's functions are
// not to be had, as OpenCV may learn at run time anyway; with its own library come drivers and LLVM, 290 MB. The
// others are of the module calib3d, for a function that OpenCV keeps for old programs.
#include <opencv2/core.hpp>

#include "tutti/base/check.hpp"

extern "C" {
void* glXGetProcAddressARB(const unsigned char*) { return nullptr; }
void* glXGetCurrentContext() { return nullptr; }
void* glXGetCurrentDisplay() { return nullptr; }
}

namespace cv {

Mat estimateAffine2D(InputArray, InputArray, OutputArray, int, double, std::size_t, double, std::size_t) {
  TUTTI_CHECK(false, "calib3d is not linked");
}
Mat estimateAffinePartial2D(InputArray, InputArray, OutputArray, int, double, std::size_t, double, std::size_t) {
  TUTTI_CHECK(false, "calib3d is not linked");
}

}  // namespace cv

# SPDX-License-Identifier: BSD-3-Clause
"""scripts/check_layers.py finds each kind of breach, at its line, and nothing in clean files."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).parents[1] / "scripts/check_layers.py"
CMAKE = "foreach(module IN ITEMS base geometry estimation simulation perception/lidar robot server wire wire/replay program lab)\nendforeach()\n"


def check(files):
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder) / "src/tutti"
        for name, text in {"CMakeLists.txt": CMAKE, **files}.items():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_text(text)
        done = subprocess.run([sys.executable, SCRIPT, folder], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout


class CheckLayers(unittest.TestCase):
    def test_clean_files_pass(self):
        code, out = check({
            "base/a.cpp": '#include <cstdio>\n#include "tutti/base/a.hpp"\nsnprintf(b, 3, "");\ndoor.exit();\n',
            "base/config_yaml.cpp": "#include <yaml-cpp/yaml.h>\n",
            "base/b.cpp": '// std::cout\nauto s = "std::cout";\n/* abort()\n exit(1); */\n',
            "base/a_test.cpp": "#include <ceres/ceres.h>\nstd::cout << 1;\n",
            "perception/lidar/a.cpp": '#include "tutti/geometry/a.hpp"\n#include <nanoflann.hpp>\n',
            "wire/replay/internal/a.hpp": '#include "tutti/wire/a.hpp"\n#include "tutti/wire/replay/a.hpp"\n',
            "../../tests/support/robot/a.hpp": '#include "tutti/robot/a.hpp"\n#include "support/geometry/a.hpp"\n',
            "robot/b_test.cpp": '#include "tutti/simulation/a.hpp"\n',
            "lab/a.cpp": '#include "tutti/program/a.hpp"\n#include "tutti/simulation/a.hpp"\n',
            "robot/a_test.cpp": '#include "support/robot/a.hpp"\n#include "support/paths.hpp"\n',
            "program/a.cpp": "#include <spdlog/spdlog.h>\nauto now = std::chrono::system_clock::now();\n",
            "wire/a.cpp": '#include "tutti/v1/a.pb.h"\n#include <google/protobuf/message.h>\n',
        })
        self.assertEqual(code, 0, out)

    def test_breaches_are_found_with_their_line(self):
        for name, line in [
            ("base/a.hpp", '#include "tutti/geometry/a.hpp"'),
            ("geometry/a_test.cpp", '#include "tutti/perception/lidar/a.hpp"'),
            ("robot/a.hpp", '#include "tutti/server/a.hpp"'),
            ("robot/b.hpp", '#include "tutti/simulation/a.hpp"'),
            ("program/a.cpp", '#include "tutti/lab/a.hpp"'),
            ("server/a.hpp", '#include "tutti/robot/a.hpp"'),
            ("server/b.hpp", '#include "tutti/wire/a.hpp"'),
            ("wire/a.hpp", '#include "tutti/wire/replay/a.hpp"'),
            ("base/a.hpp", '#include "tutti/nowhere/a.hpp"'),
            ("attic/a.hpp", "int x;"),
            ("robot/a.cpp", '#include "support/robot/a.hpp"'),
            ("geometry/a_test.cpp", '#include "support/robot/a.hpp"'),
            ("../../tests/support/geometry/a.hpp", '#include "tutti/robot/a.hpp"'),
            ("base/other.cpp", "#include <yaml-cpp/yaml.h>"),
            ("robot/a.cpp", '#include "tutti/v1/a.pb.h"'),
            ("robot/a.cpp", "#include <google/protobuf/message.h>"),
            ("geometry/a.cpp", "#include <ceres/ceres.h>"),
            ("estimation/a.hpp", "#include <ceres/ceres.h>"),
            ("estimation/a.cpp", "#include <Spectra/SymEigsSolver.h>"),
            ("perception/lidar/a.hpp", "#include <nanoflann.hpp>"),
            ("wire/a.cpp", "#include <sqlite3.h>"),
            ("wire/a.cpp", "#include <nats/nats.h>"),
            ("program/a.hpp", "#include <spdlog/spdlog.h>"),
            ("program/a.cpp", '  std::getenv("HOME");'),
            ("base/a.cpp", "  std::cout << 1;"),
            ("base/a.cpp", '  printf("");'),
            ("base/a.cpp", "  std::abort();"),
            ("base/a.cpp", "  exit(1);"),
            ("base/a.cpp", '  const char* home = std::getenv("HOME");'),
            ("base/a.cpp", "  auto now = std::chrono::system_clock::now();"),
        ]:
            number = 1 if name.startswith("attic") else 3
            code, out = check({name: f"//\n\n{line}\n"})
            self.assertEqual(code, 1, (name, line))
            self.assertIn(f"{name.removeprefix('../../')}:{number}: ", out)
            self.assertEqual(len(out.splitlines()), 1, out)


if __name__ == "__main__":
    unittest.main()

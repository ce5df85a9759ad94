"""C, C++ and Python offer the same functions under the same names, and the table in docs/host.md lists them."""
import pathlib
import sys
import unittest

from test_rapid import main, root

sys.path.insert(0, str(pathlib.Path(root) / "docs/reference"))
import faces  # noqa: E402


class TestFaces(unittest.TestCase):
    def test_none_of_the_three_lacks_what_another_one_offers(self):
        self.assertEqual(faces.differences(), [])

    def test_the_table_in_the_guide_is_that_of_the_headers(self):
        self.assertEqual(faces.document(), faces.DOCUMENT.read_text(encoding="utf-8"),
                         "run python3 docs/reference/faces.py")

    def test_the_names_are_found(self):
        self.assertGreater(sum(map(len, faces.functions_in_c()[0].values())), 60)


if __name__ == "__main__":
    main()

"""YAML files of typed records: read and written by the annotations, defaults and docstrings of the class itself."""

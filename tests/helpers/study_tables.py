"""Rows of studies, from tables that state only what a test is about."""

import pandas as pd
import pyarrow as pa

from scenarios.experiments.statistics import COLUMNS, StudyRows, study_rows
from scenarios.experiments.trials import CONTRACT


def gathered(rows: pd.DataFrame) -> StudyRows:
    """As a study's parts hold them; columns that are left out are null."""
    schema = pa.schema([CONTRACT.field(name) for name in COLUMNS])
    table = pa.Table.from_pandas(rows.reindex(columns=list(COLUMNS)), schema, preserve_index=False)
    return study_rows([table])

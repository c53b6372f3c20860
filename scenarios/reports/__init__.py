"""Results for people: tables, figures and notes, and how they are drawn."""

"""Methods side by side: the same recordings for all, and what each made of them."""

"""What is wrong with logs and estimates: one comparison of how well readings of logs predict the currents."""

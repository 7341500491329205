"""Recording a running rack from outside."""
